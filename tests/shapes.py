"""Analytic surfaces: each function returns vertices (n, 3) and faces (m, 3), seen from outside."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

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
