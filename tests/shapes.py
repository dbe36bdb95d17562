"""Analytic surfaces: each function returns vertices (n, 3) and faces (m, 3), seen from outside."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

Shape = tuple[NDArray[np.float64], NDArray[np.int64]]

BRAIN_SIZE = (600.0, 300.0, 150.0)
"""Edges of a box as large as a fly brain, micrometres."""


def box(
    size: tuple[float, float, float] = BRAIN_SIZE,
    center: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Shape:
    """Closed, genus 0, 8 vertices."""
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))]
    return corners * size + center, np.array(faces)


def torus(radius: float = 200.0, tube: float = 80.0, around: int = 48, across: int = 24) -> Shape:
    """Closed, genus 1, its hole along z; volume about 2 pi^2 radius tube^2."""
    u = np.repeat(np.arange(around), across) * 2 * np.pi / around
    v = np.tile(np.arange(across), around) * 2 * np.pi / across
    ring = radius + tube * np.cos(v)
    vertices = np.column_stack([ring * np.cos(u), ring * np.sin(u), tube * np.sin(v)])
    i, j = np.divmod(np.arange(around * across), across)
    here, beyond = i * across, (i + 1) % around * across
    a, b, c, d = here + j, beyond + j, beyond + (j + 1) % across, here + (j + 1) % across
    return vertices, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def together(*shapes: Shape) -> Shape:
    """Several shapes as one mesh, one after the other."""
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in shapes)])
    faces = [faces + start for (_, faces), start in zip(shapes, starts, strict=False)]
    return np.concatenate([vertices for vertices, _ in shapes]), np.concatenate(faces)


def inside_out(shape: Shape) -> Shape:
    """The same surface with all faces turned."""
    vertices, faces = shape
    return vertices, faces[:, ::-1]


def sphere(radius: float = 100.0, rounds: int = 3) -> Shape:
    """Closed, genus 0: an octahedron whose faces are quartered `rounds` times."""
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])
    upper = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4)]
    faces = np.array([*upper, *((b, a, 5) for a, b, _ in upper)])
    for _ in range(rounds):
        sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        edges, number = np.unique(sides, axis=0, return_inverse=True)
        middle = number.reshape(-1, 3) + len(vertices)
        vertices = np.concatenate([vertices, vertices[edges].mean(axis=1)])
        (a, b, c), (d, e, f) = faces.T, middle.T
        faces = np.concatenate(
            [np.stack(corners, axis=1) for corners in ((a, d, f), (d, b, e), (f, e, c), (d, e, f))]
        )
    length = np.linalg.norm(vertices, axis=1, keepdims=True)
    return radius * vertices / length, faces


def tetrahedron() -> Shape:
    """Closed, genus 0, every vertex with 3 neighbours, centred at 0."""
    vertices = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    return vertices, np.array([(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)])


def annulus(around: int = 12, layers: int = 4) -> Shape:
    """A flat ring of regular faces, hole first: vertex `layer * around + place`, seen from +z."""
    layer, place = np.divmod(np.arange(around * (layers + 1)), around)
    angle, radius = 2 * np.pi * place / around, 1 + layer
    vertices = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle], axis=1)
    inner, at = np.divmod(np.arange(around * layers), around)
    a, b = inner * around + at, inner * around + (at + 1) % around
    c, d = b + around, a + around
    return vertices, np.concatenate([np.stack([a, d, c], axis=1), np.stack([a, c, b], axis=1)])


def random_annulus(rng: np.random.Generator, outer: int, hole: int, inner: int) -> Shape:
    """A flat ring of irregular faces: first `outer` vertices outside, then `hole`, then inner ones.

    Both boundaries run counter-clockwise; 8 vertices outside are the fewest. Edges across the ring
    from boundary to boundary occur.
    """
    angles = [np.sort(rng.uniform(0, 2 * np.pi, count)) for count in (outer, hole, inner)]
    for loop, count in ((0, outer), (1, hole)):  # evened, so that the outside surrounds the hole
        angles[loop] = (angles[loop] + 9 * np.arange(count) * 2 * np.pi / count) / 10
    radius = np.concatenate(
        [np.full(outer, 10.0), np.full(hole, 2.0), rng.uniform(2.2, 7.5, inner)]
    )
    angle = np.concatenate(angles)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    faces = Delaunay(points).simplices.astype(np.int64)
    faces = faces[~((faces >= outer) & (faces < outer + hole)).all(axis=1)]
    a, b, c = (points[faces[:, corner]] for corner in range(3))
    turned = (b - a)[:, 0] * (c - a)[:, 1] < (b - a)[:, 1] * (c - a)[:, 0]
    faces[turned] = faces[turned][:, ::-1]
    return np.column_stack([points, np.zeros(len(points))]), faces
