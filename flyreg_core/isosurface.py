"""Stage 2c: marching tetrahedra on the Kuhn grid, whose surface has the topology of the labels."""

from __future__ import annotations

from functools import cache
from itertools import permutations

import numpy as np

from flyreg_core.mesh import Floats, Integers, SurfaceMesh

CLOSEST_TO_CORNER = 0.1
"""No vertex lies nearer to an end of its grid edge than this share of it: no slivers of zero area."""


@cache
def _tetrahedra() -> tuple[tuple[tuple[int, ...], ...], ...]:
    """Return the corners of the 6 tetrahedra of a cube, paths from one corner to the opposite."""
    tetrahedra = []
    for order in permutations(range(3)):
        corner = [0, 0, 0]
        path = [tuple(corner)]
        for axis in order:
            corner[axis] = 1
            path.append(tuple(corner))
        tetrahedra.append(tuple(path))
    return tuple(tetrahedra)


def _cut_tetrahedron(corners: np.ndarray, case: int) -> list[list[tuple[int, int]]]:
    """Return the triangles, as triples of edges (inside corner, outside corner), facing outwards."""
    inside = [k for k in range(4) if case >> k & 1]
    outside = [k for k in range(4) if not case >> k & 1]
    if len(inside) == 1 or len(outside) == 1:
        polygons = [[(a, b) for a in inside for b in outside]]
    else:
        (a, b), (c, d) = inside, outside
        polygons = [[(a, c), (a, d), (b, d)], [(a, c), (b, d), (b, c)]]
    outwards = corners[outside].mean(axis=0) - corners[inside].mean(axis=0)
    for polygon in polygons:
        p, q, r = ((corners[a] + corners[b]) / 2 for a, b in polygon)
        if np.dot(np.cross(q - p, r - p), outwards) < 0:
            polygon.reverse()
    return polygons


def extract_surface(field: Floats, origin: Floats, pitch: float) -> SurfaceMesh:
    """Return the surface where a field on a cubic grid passes from positive (inside) to not.

    Parameters
    ----------
    field : (nx, ny, nz) float
        Positive inside; the outermost layer must not be. Linear along the grid's edges.
    origin : (3,) float
        Centre of voxel (0, 0, 0), micrometres.
    pitch : float
        Edge of a voxel, micrometres.

    Returns
    -------
    SurfaceMesh
        Closed, manifold, oriented outwards, with the topology of the inside voxels under the
        14-neighbourhood. Vertices in the order of their grid edges.
    """
    return extract_surface_and_voxels(field, origin, pitch)[0]


def extract_surface_and_voxels(
    field: Floats, origin: Floats, pitch: float
) -> tuple[SurfaceMesh, Integers]:
    """Return what `extract_surface` does, and the grid edge each vertex lies on.

    Returns
    -------
    (n, 2) int
        The flat indices of the voxel inside and the voxel outside.
    """
    inside = field > 0
    corner_labels = np.stack([_shifted(inside, offset) for offset in np.ndindex(2, 2, 2)])
    mixed = corner_labels.any(axis=0) & ~corner_labels.all(axis=0)
    cubes = np.stack(np.nonzero(mixed), axis=-1)
    edges = []
    for tetrahedron in _tetrahedra():
        corners = np.array(tetrahedron)
        voxels = cubes[:, None] + corners[None]
        bits = inside[tuple(np.moveaxis(voxels, -1, 0))]
        cases = bits @ (1 << np.arange(4))
        index = np.ravel_multi_index(tuple(np.moveaxis(voxels, -1, 0)), field.shape)
        for case in range(1, 15):
            found = index[cases == case]
            for triangle in _cut_tetrahedron(corners.astype(float), case):
                edges.append(np.stack([found[:, list(edge)] for edge in triangle], axis=1))
    return _surface_of_edges(np.concatenate(edges), field, origin, pitch)


def _shifted(inside: np.ndarray, offset: tuple[int, ...]) -> np.ndarray:
    return inside[tuple(slice(o, n - 1 + o) for o, n in zip(offset, inside.shape, strict=True))]


def _surface_of_edges(
    edges: Integers, field: Floats, origin: Floats, pitch: float
) -> tuple[SurfaceMesh, Integers]:
    """Return the surface whose face corners lie on the (m, 3, 2) grid edges (inside, outside)."""
    key = edges[..., 0] * field.size + edges[..., 1]
    unique, faces = np.unique(key, return_inverse=True)
    ends = np.stack(np.divmod(unique, field.size), axis=-1)
    values = field.reshape(-1)[ends]
    share = values[:, 0] / (values[:, 0] - values[:, 1])
    share = np.clip(share, CLOSEST_TO_CORNER, 1 - CLOSEST_TO_CORNER)[:, None]
    positions = np.stack(np.unravel_index(ends, field.shape), axis=-1).astype(float)
    vertices = origin + pitch * ((1 - share) * positions[:, 0] + share * positions[:, 1])
    return SurfaceMesh(vertices, faces.reshape(-1, 3)), ends
