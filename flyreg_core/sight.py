"""What a line of sight meets first on a surface, found in the surface's tree of boxes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from flyreg_core.mesh import Floats, Integers, SurfaceMesh
from flyreg_core.surface_tree import DEEPEST

EDGE = 1e-9
"""As a share of a face: a line that passes an edge by less meets both faces, so none slips between."""


@dataclass(frozen=True, eq=False)
class Sight:
    """Where a line of sight meets a surface first."""

    face: int
    barycentric: Floats  # (3,)
    point: Floats  # (3,), micrometres
    distance: float  # from the start of the line, micrometres
    is_front: bool  # the face turns its outside to the line's start


def look(
    surface: SurfaceMesh,
    start: Floats,
    direction: Floats,
    nearest: float = -np.inf,
    farthest: float = np.inf,
) -> Sight | None:
    """Return where a line meets a surface first, or None where it passes beside it.

    Parameters
    ----------
    start, direction : (3,) float
        A point of the line, and the unit direction in which it is followed.
    nearest, farthest : float
        From where to where it is followed, micrometres along the direction from `start`.
    """
    tree = surface.tree
    line = np.ascontiguousarray(np.concatenate([start, direction]), dtype=np.float64)
    row, distance, v, w, facing = _look(
        tree.boxes, tree.first, tree.corners, line, nearest, farthest
    )
    if row < 0:
        return None
    barycentric = np.array([1 - v - w, v, w])
    point = barycentric @ tree.corners[row].reshape(3, 3)
    return Sight(int(tree.face[row]), barycentric, point, float(distance), bool(facing < 0))


@njit(nogil=True, cache=True)
def _look(
    boxes: Floats, first: Integers, corners: Floats, line: Floats, nearest: float, farthest: float
) -> tuple[int, float, float, float, float]:
    """Return row, distance, two coordinates of the place, and how the face turns to the line."""
    waiting = np.zeros(DEEPEST, dtype=np.int64)
    leaves, count = len(first) - 1, 1
    found, best, best_v, best_w, facing = -1, farthest, 0.0, 0.0, 0.0
    while count > 0:
        count -= 1
        box = waiting[count]
        if not _passes(boxes, box, line, nearest, best):
            continue
        if box < leaves - 1:
            waiting[count], waiting[count + 1] = 2 * box + 1, 2 * box + 2
            count += 2
            continue
        for row in range(first[box - leaves + 1], first[box - leaves + 2]):
            distance, v, w, turn = _meet(corners, row, line)
            if nearest <= distance < best:
                found, best, best_v, best_w, facing = row, distance, v, w, turn
    return found, best, best_v, best_w, facing


@njit(nogil=True, cache=True)
def _passes(boxes: Floats, box: int, line: Floats, nearest: float, farthest: float) -> bool:
    """Tell whether a stretch of a line passes through a box."""
    enter, leave = nearest, farthest
    for i in range(3):
        if line[3 + i] == 0:
            if line[i] < boxes[box, i] or line[i] > boxes[box, 3 + i]:
                return False
            continue
        one, other = (
            (boxes[box, i] - line[i]) / line[3 + i],
            (boxes[box, 3 + i] - line[i]) / line[3 + i],
        )
        enter, leave = max(enter, min(one, other)), min(leave, max(one, other))
    return bool(enter <= leave + EDGE * (1 + abs(leave)))


@njit(nogil=True, cache=True)
def _meet(corners: Floats, row: int, line: Floats) -> tuple[float, float, float, float]:
    """Return the distance at which a line meets a face, infinite if it does not, and where.

    Möller and Trumbore, Fast, minimum storage ray-triangle intersection, J. Graphics Tools 2, 1997.
    """
    px, py, pz = (
        corners[row, 3] - corners[row, 0],
        corners[row, 4] - corners[row, 1],
        corners[row, 5] - corners[row, 2],
    )
    qx, qy, qz = (
        corners[row, 6] - corners[row, 0],
        corners[row, 7] - corners[row, 1],
        corners[row, 8] - corners[row, 2],
    )
    x, y, z = line[0] - corners[row, 0], line[1] - corners[row, 1], line[2] - corners[row, 2]
    dx, dy, dz = line[3], line[4], line[5]
    hx, hy, hz = dy * qz - dz * qy, dz * qx - dx * qz, dx * qy - dy * qx
    volume = px * hx + py * hy + pz * hz  # positive where the line meets the front
    if volume == 0:
        return np.inf, 0.0, 0.0, 0.0
    v = (x * hx + y * hy + z * hz) / volume
    kx, ky, kz = y * pz - z * py, z * px - x * pz, x * py - y * px
    w = (dx * kx + dy * ky + dz * kz) / volume
    if v < -EDGE or w < -EDGE or v + w > 1 + EDGE:
        return np.inf, 0.0, 0.0, 0.0
    return (qx * kx + qy * ky + qz * kz) / volume, v, w, -volume
