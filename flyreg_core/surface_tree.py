"""The places of a surface that are nearest to points of space, found in a tree of boxes.

Compiled without the interpreter's lock, so that the window stays alive; and each search starts from
what the one before found, as points that follow one another mostly lie next to one another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

LEAF = 2
"""Most faces in one of the smallest boxes."""
FLAT = 1e-24
"""A face is a line if its squared area is less than this share of its longest side to the fourth."""
DEEPEST = 64
"""Boxes within boxes that a search keeps in mind; more faces than there can be need fewer."""


@dataclass(frozen=True, eq=False)
class SurfaceTree:
    """A surface's faces in boxes within boxes: box k holds boxes 2 k + 1 and 2 k + 2."""

    boxes: Floats  # (b, 6), lowest and highest coordinates, micrometres
    first: Integers  # (b + 1,), rows where the faces of each of the last, smallest boxes begin
    corners: Floats  # (m, 9), of the faces, box by box, micrometres
    face: Integers  # (m,), their numbers on the surface

    def nearest(self, points: Floats) -> tuple[Floats, Integers, Floats]:
        """Return where the surface is nearest to (n, 3) points; of equals, on the first face.

        Returns
        -------
        (n,) float, (n,) int, (n, 3) float
            Squared distances, faces, and the barycentric coordinates of the places in them, none
            negative.
        """
        squared, face = np.zeros(len(points)), np.zeros(len(points), dtype=np.int64)
        barycentric = np.zeros((len(points), 3))
        tree = self.boxes, self.first, self.corners, self.face
        _find_nearest(*tree, np.ascontiguousarray(points), squared, face, barycentric)
        return squared, face, barycentric


def build_tree(vertices: Floats, faces: Integers) -> SurfaceTree:
    """Return the tree of (m, 3) faces, at least one, over (n, 3) vertices."""
    corners = vertices[faces]
    middles = corners.mean(axis=1)
    depth = 0
    while len(corners) > LEAF << depth:
        depth += 1
    face = np.arange(len(corners))
    first = _sort_into_boxes(middles, face, depth)
    corners = corners[face].reshape(-1, 9)
    return SurfaceTree(_boxes(corners, first), first, corners, face)


@njit(nogil=True, cache=True)
def _sort_into_boxes(middles: Floats, face: Integers, depth: int) -> Integers:
    """Sort the numbers of faces so that equal shares of them lie together; return where each begins.

    Each range is parted in two by the faces' middles, across the direction in which they spread
    most.
    """
    first = np.array([0, len(face)])
    for _ in range(depth):
        finer = np.zeros(2 * len(first) - 1, dtype=np.int64)
        for k in range(len(first) - 1):
            low, high = first[k], first[k + 1]
            finer[2 * k], finer[2 * k + 1] = low, (low + high) // 2
            _part(middles, face, low, high, (low + high) // 2)
        finer[-1] = len(face)
        first = finer
    return first


@njit(nogil=True, cache=True)
def _part(middles: Floats, face: Integers, low: int, high: int, middle: int) -> None:
    """Sort face[low:high] so that none before `middle` lies beyond one after it (Hoare)."""
    lowest, highest = np.full(3, np.inf), np.full(3, -np.inf)
    for k in range(low, high):
        for i in range(3):
            lowest[i] = min(lowest[i], middles[face[k], i])
            highest[i] = max(highest[i], middles[face[k], i])
    axis = int(np.argmax(highest - lowest))
    left, right = low, high - 1
    while left < right:
        pivot = middles[face[(left + right) // 2], axis]
        i, j = left, right
        while i <= j:
            while middles[face[i], axis] < pivot:
                i += 1
            while middles[face[j], axis] > pivot:
                j -= 1
            if i <= j:
                face[i], face[j] = face[j], face[i]
                i += 1
                j -= 1
        if middle <= j:
            right = j
        elif middle >= i:
            left = i
        else:
            return


@njit(nogil=True, cache=True)
def _boxes(corners: Floats, first: Integers) -> Floats:
    """Return the boxes around faces, the largest first, each before the two that it holds."""
    leaves = len(first) - 1
    boxes = np.zeros((2 * leaves - 1, 6))
    boxes[:, :3], boxes[:, 3:] = np.inf, -np.inf
    for leaf in range(leaves):
        box = boxes[leaves - 1 + leaf]
        for row in range(first[leaf], first[leaf + 1]):
            for i in range(9):
                box[i % 3] = min(box[i % 3], corners[row, i])
                box[3 + i % 3] = max(box[3 + i % 3], corners[row, i])
    for k in range(leaves - 2, -1, -1):
        for i in range(3):
            boxes[k, i] = min(boxes[2 * k + 1, i], boxes[2 * k + 2, i])
            boxes[k, 3 + i] = max(boxes[2 * k + 1, 3 + i], boxes[2 * k + 2, 3 + i])
    return boxes


@njit(nogil=True, cache=True)
def _find_nearest(
    boxes: Floats,
    first: Integers,
    corners: Floats,
    face: Integers,
    points: Floats,
    squared: Floats,
    nearest: Integers,
    barycentric: Floats,
) -> None:
    """Fill in for each point the squared distance, the face and the place in it."""
    waiting, away = np.zeros(DEEPEST, dtype=np.int64), np.zeros(DEEPEST)
    leaves = len(first) - 1
    row = 0
    for k in range(len(points)):
        x, y, z = points[k]
        best, u, v, w = _nearest_in_face(corners, row, x, y, z)
        waiting[0], away[0], count = 0, _to_box(boxes, 0, x, y, z), 1
        while count > 0:
            count -= 1
            box = waiting[count]
            if away[count] > best:
                continue
            if box >= leaves - 1:
                leaf = box - leaves + 1
                for other in range(first[leaf], first[leaf + 1]):
                    found, p, q, r = _nearest_in_face(corners, other, x, y, z)
                    if found < best or (found == best and face[other] < face[row]):
                        best, u, v, w, row = found, p, q, r, other
                continue
            near, far = 2 * box + 1, 2 * box + 2
            to_near, to_far = _to_box(boxes, near, x, y, z), _to_box(boxes, far, x, y, z)
            if to_far < to_near:
                near, far, to_near, to_far = far, near, to_far, to_near
            if to_far <= best:
                waiting[count], away[count] = far, to_far
                count += 1
            if to_near <= best:
                waiting[count], away[count] = near, to_near
                count += 1
        squared[k], nearest[k] = best, face[row]
        barycentric[k, 0], barycentric[k, 1], barycentric[k, 2] = u, v, w


@njit(nogil=True, cache=True)
def _to_box(boxes: Floats, box: int, x: float, y: float, z: float) -> float:
    """Return the squared distance of a point from a box."""
    a = max(boxes[box, 0] - x, x - boxes[box, 3], 0.0)
    b = max(boxes[box, 1] - y, y - boxes[box, 4], 0.0)
    c = max(boxes[box, 2] - z, z - boxes[box, 5], 0.0)
    return float(a * a + b * b + c * c)


@njit(nogil=True, cache=True)
def _nearest_in_face(
    corners: Floats, row: int, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Return the squared distance of a point from a face, and the nearest place's coordinates in it.

    The foot on the face's plane if that lies within, or else the nearest place of the sides.
    """
    ax, ay, az = x - corners[row, 0], y - corners[row, 1], z - corners[row, 2]
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
    pp, qq = px * px + py * py + pz * pz, qx * qx + qy * qy + qz * qz
    pq = px * qx + py * qy + pz * qz
    pa, qa = px * ax + py * ay + pz * az, qx * ax + qy * ay + qz * az
    area = pp * qq - pq * pq  # squared, of the parallelogram
    v, w = qq * pa - pq * qa, pp * qa - pq * pa
    if v >= 0 and w >= 0 and v + w <= area and area > FLAT * max(pp, qq) ** 2:
        v, w = v / area, w / area
        dx, dy, dz = ax - v * px - w * qx, ay - v * py - w * qy, az - v * pz - w * qz
        return dx * dx + dy * dy + dz * dz, max(1 - v - w, 0.0), v, w
    aa = ax * ax + ay * ay + az * az
    v = min(max(pa / pp, 0.0), 1.0) if pp > 0 else 0.0
    best, one, other = aa + v * (v * pp - 2 * pa), v, 0.0
    w = min(max(qa / qq, 0.0), 1.0) if qq > 0 else 0.0
    found = aa + w * (w * qq - 2 * qa)
    if found < best:
        best, one, other = found, 0.0, w
    side = pp + qq - 2 * pq  # squared length of the third side, from the second corner on
    along = (qa - pa + pp - pq) / side if side > 0 else 0.0
    along = min(max(along, 0.0), 1.0)
    v, w = 1 - along, along
    found = aa + v * (v * pp - 2 * pa) + w * (w * qq - 2 * qa) + 2 * v * w * pq
    if found < best:
        one, other = v, w
    dx, dy, dz = ax - one * px - other * qx, ay - one * py - other * qy, az - one * pz - other * qz
    return dx * dx + dy * dy + dz * dz, max(1 - one - other, 0.0), one, other
