"""Find which flat triangle a flat point lies in, and where in it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import igl
import numpy as np
from numba import njit

from flyreg_core.mesh import FlatMesh, Floats, Integers

TRIANGLES_PER_CELL = 2.0
MOST_STEPS = 50
"""A walk that has not arrived after so many triangles is given up: the grid finds the point."""


@dataclass(frozen=True, eq=False)
class TriangleGrid:
    """Triangles sorted into the cells of a grid; rows are as high as the triangles are dense."""

    corners: Floats  # (m, 3, 2)
    face_of: Integers  # (m,), the face each triangle is (a copy of)
    rows: Floats  # (r + 1,), borders of the rows
    low: float  # left border
    width: float  # of a column
    columns: int
    starts: Integers  # (r * columns + 1,), where each cell's triangles start in `members`
    members: Integers
    neighbours: Integers  # (n, 3), of each face the one across from each corner, or -1


def build_grid(corners: Floats, face_of: Integers, faces: Integers) -> TriangleGrid:
    """Return a grid over (m, 3, 2) triangles that tile a region of the plane.

    Parameters
    ----------
    face_of : (m,) int
        The face that each triangle is, the first n in turn, or a copy of.
    faces : (n, 3) int
    """
    side = max(1, int(np.sqrt(len(corners) / TRIANGLES_PER_CELL)))
    rows = np.unique(np.quantile(corners[..., 1], np.linspace(0, 1, side + 1)))
    low, high = float(corners[..., 0].min()), float(corners[..., 0].max())
    width = max((high - low) / side, np.finfo(float).tiny)
    column = np.clip(((corners[..., 0] - low) / width).astype(np.int64), 0, side - 1)
    row = np.clip(np.searchsorted(rows, corners[..., 1], side="right") - 1, 0, len(rows) - 2)
    # a corner exactly on a border belongs to the cells of both sides
    row_below = np.clip(np.searchsorted(rows, corners[..., 1], side="left") - 1, 0, len(rows) - 2)
    boxes = np.stack(
        [row_below.min(axis=1), row.max(axis=1), column.min(axis=1), column.max(axis=1)], axis=1
    )
    starts, members = _fill(boxes, len(rows) - 1, side)
    neighbours = find_neighbours(faces)
    return TriangleGrid(corners, face_of, rows, low, width, side, starts, members, neighbours)


def strip_grid(flat: FlatMesh) -> TriangleGrid:
    """Return a grid over a whole strip, 0 <= u < 1, with copies of triangles that reach beyond."""
    corners = flat.corners
    first = np.floor(corners[..., 0].min(axis=1))
    corners = corners - np.stack([first, np.zeros_like(first)], axis=1)[:, None]
    beyond = corners[..., 0].max(axis=1) >= 1
    copies = corners[beyond] - [1.0, 0.0]
    faces = np.arange(len(corners))
    return build_grid(
        np.concatenate([corners, copies]), np.concatenate([faces, faces[beyond]]), flat.faces
    )


def once_around(uv: Floats) -> Floats:
    """Return (k, 2) places of a strip with 0 <= u < 1, where its grid knows them."""
    return np.stack([np.mod(uv[:, 0], 1.0), uv[:, 1]], axis=1)


def find_neighbours(faces: Integers) -> Integers:
    """Return for (n, 3) faces the face across from each corner, -1 at a boundary."""
    across_edges, _ = igl.triangle_triangle_adjacency(faces)  # of corners 0 and 1, 1 and 2, 2 and 0
    return np.ascontiguousarray(np.roll(across_edges, -1, axis=1))


def find_triangles(
    grid: TriangleGrid, points: Floats, near: Integers | None = None
) -> tuple[Integers, Floats]:
    """Return for (k, 2) points the face each lies in and its (k, 3) barycentric coordinates.

    With `near`, on a strip, a face close to each point, it is looked for by a walk from there, each
    step across the edge that the point lies farthest beyond; the grid is for walks that do not arrive.

    A point in no triangle, by rounding or because it is outside, gets the triangle of its cell
    that it is least outside of, and coordinates moved into it; -1 where its cell is empty.
    """
    if near is not None:
        found, barycentric = _walk(points, near, grid.corners, grid.neighbours)
        lost = np.flatnonzero(found < 0)
        if len(lost):
            found[lost], barycentric[lost] = find_triangles(grid, once_around(points[lost]))
        return found, barycentric
    row = np.clip(np.searchsorted(grid.rows, points[:, 1], side="right") - 1, 0, len(grid.rows) - 2)
    column = np.clip(((points[:, 0] - grid.low) / grid.width).astype(np.int64), 0, grid.columns - 1)
    found, barycentric = _find(
        np.ascontiguousarray(points),
        row * grid.columns + column,
        grid.corners,
        grid.starts,
        grid.members,
    )
    return np.where(found >= 0, grid.face_of[found], -1), barycentric


@njit(nogil=True, cache=True)
def _fill(boxes: Integers, n_rows: int, n_columns: int) -> tuple[Integers, Integers]:
    count = np.zeros(n_rows * n_columns + 1, dtype=np.int64)
    for t in range(len(boxes)):
        for r in range(boxes[t, 0], boxes[t, 1] + 1):
            for c in range(boxes[t, 2], boxes[t, 3] + 1):
                count[r * n_columns + c + 1] += 1
    starts = np.cumsum(count)
    place = starts.copy()
    members = np.zeros(starts[-1], dtype=np.int64)
    for t in range(len(boxes)):
        for r in range(boxes[t, 0], boxes[t, 1] + 1):
            for c in range(boxes[t, 2], boxes[t, 3] + 1):
                cell = r * n_columns + c
                members[place[cell]] = t
                place[cell] += 1
    return starts, members


@njit(nogil=True, cache=True)
def _find(
    points: Floats, cell: Integers, corners: Floats, starts: Integers, members: Integers
) -> tuple[Integers, Floats]:
    found = np.full(len(points), -1, dtype=np.int64)
    barycentric = np.zeros((len(points), 3))
    for k in range(len(points)):
        x, y = points[k, 0], points[k, 1]
        best = -np.inf
        for m in range(starts[cell[k]], starts[cell[k] + 1]):
            t = members[m]
            ax, ay = corners[t, 0, 0] - x, corners[t, 0, 1] - y
            bx, by = corners[t, 1, 0] - x, corners[t, 1, 1] - y
            cx, cy = corners[t, 2, 0] - x, corners[t, 2, 1] - y
            wa, wb, wc = bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx
            total = wa + wb + wc
            if total <= 0:
                continue
            wa, wb, wc = wa / total, wb / total, wc / total
            least = min(wa, wb, wc)
            if least > best:
                best = least
                found[k] = t
                wa, wb, wc = max(wa, 0.0), max(wb, 0.0), max(wc, 0.0)
                total = wa + wb + wc
                barycentric[k, 0], barycentric[k, 1], barycentric[k, 2] = (
                    wa / total,
                    wb / total,
                    wc / total,
                )
                if least >= 0:
                    break
    return found, barycentric


@njit(nogil=True, cache=True)
def _walk(
    places: Floats, near: Integers, corners: Floats, neighbours: Integers
) -> tuple[Integers, Floats]:
    """Return the faces that (k, 2) places of a strip lie in, -1 if not reached, and where in them.

    One loop without helpers: a compiled helper that is given arrays counts who holds them, at each
    call and in turn with the other threads, which takes as long as a step of the walk.
    """
    found = np.full(len(places), -1, dtype=np.int64)
    barycentric = np.zeros((len(places), 3))
    for k in range(len(places)):
        u, v, t = places[k, 0], places[k, 1], near[k]
        for _ in range(MOST_STEPS):
            if t < 0:
                break
            ax, bx, cx = corners[t, 0, 0], corners[t, 1, 0], corners[t, 2, 0]
            x = u + math.floor((ax + bx + cx) / 3 - u + 0.5)
            ax, bx, cx = ax - x, bx - x, cx - x
            ay, by, cy = corners[t, 0, 1] - v, corners[t, 1, 1] - v, corners[t, 2, 1] - v
            wa, wb, wc = bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx
            total = wa + wb + wc
            if total <= 0:
                break
            if wa >= 0 and wb >= 0 and wc >= 0:
                found[k] = t
                barycentric[k, 0] = wa / total
                barycentric[k, 1] = wb / total
                barycentric[k, 2] = wc / total
                break
            across = 0
            if wb < wa and wb <= wc:
                across = 1
            elif wc < wa:
                across = 2
            t = neighbours[t, across]
    return found, barycentric
