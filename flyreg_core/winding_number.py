"""How often a surface winds around points of space, whatever holes, sheets and crossings it has.

Compiled without the interpreter's lock, so that the window stays alive and both cores work.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from flyreg_core.mesh import Floats, Integers
from flyreg_core.progress import Report, ignore
from flyreg_core.side_by_side import side_by_side
from flyreg_core.surface_tree import DEEPEST, SurfaceTree, build_tree

FAR = 1.8
"""Points are far from faces if they are so many times farther from their centre than these reach."""
TOGETHER = 64
"""Points that lie in one cube, on average, and are asked together."""
PART = 150
"""Cubes asked at once; between parts the work can be cancelled."""
MOMENTS = 26
"""Of the faces in a box: centre, squared reach, and the coefficients of `_add_from_far`."""


def winding_numbers(
    points: Floats, vertices: Floats, faces: Integers, report: Report = ignore, text: str = ""
) -> Floats:
    """Return (n,) generalised winding numbers of (n, 3) points: 1 inside and 0 outside if closed.

    Parameters
    ----------
    vertices, faces : (v, 3) float, (m, 3) int
        A surface whose normals point outwards, at least one face.

    Notes
    -----
    The sum of the solid angles of all faces. Those in a box that is far away count together by the
    Taylor expansion around their centre up to the second order, wrong by a few thousandths at most.

    References
    ----------
    Barill, Dickson, Schmidt, Levin, Jacobson, Fast winding numbers for soups and clouds, ACM TOG
    37(4), 2018, doi:10.1145/3197517.3201337. Solid angle: Van Oosterom, Strackee, IEEE Trans.
    Biomed. Eng. 30, 1983, doi:10.1109/TBME.1983.325207.
    """
    tree = build_tree(vertices, faces)
    moments = _moments(tree)
    order, starts = _by_cubes(points)
    x, y, z = np.ascontiguousarray(points[order].T)

    def of_cubes(cubes: Integers) -> Floats:
        return np.asarray(_solid_angles(tree.first, tree.corners, moments, x, y, z, cubes))

    parts = [starts[k : k + PART + 1] for k in range(0, len(starts) - 1, PART)]
    angles = np.zeros(len(points))
    angles[order] = np.concatenate(side_by_side(of_cubes, parts, report, text))
    return angles / (4 * np.pi)


def _by_cubes(points: Floats) -> tuple[Integers, Integers]:
    """Return an order of points in which those in one cube follow one another, and where each begins."""
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    edge = float(np.cbrt(np.maximum(extent, 1e-3 * extent.max()).prod() * TOGETHER / len(points)))
    cell = ((points - low) / edge).astype(np.int64) if edge > 0 else np.zeros(points.shape, int)
    key = np.ravel_multi_index(tuple(cell.T), tuple(cell.max(axis=0) + 1))
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    return order, np.append(starts, len(points))


def _moments(tree: SurfaceTree) -> Floats:
    """Return (b, 26) centre, squared reach and moments of the faces in each box of a tree."""
    origin = (tree.boxes[0, :3] + tree.boxes[0, 3:]) / 2
    corners = tree.corners.reshape(-1, 3, 3) - origin
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    areas, middles = np.linalg.norm(normals, axis=1), corners.mean(axis=1)
    products = np.einsum("mci,mcj->mij", corners, corners)
    products = (products + 9 * middles[:, :, None] * middles[:, None]) / 12
    of_face = (
        *(areas, areas[:, None] * middles, normals, middles[:, :, None] * normals[:, None]),
        products[:, :, :, None] * normals[:, None, None] / 2,
    )
    levels = [[np.add.reduceat(each, tree.first[:-1]) for each in of_face]]
    while len(levels[0][0]) > 1:
        levels.insert(0, [each[::2] + each[1::2] for each in levels[0]])
    area, center, *integrals = map(np.concatenate, zip(*levels, strict=True))
    center /= np.maximum(area, np.finfo(float).tiny)[:, None]
    about = _about(center, *integrals)
    center += origin
    farthest = np.maximum(center - tree.boxes[:, :3], tree.boxes[:, 3:] - center)
    return np.column_stack([center, (farthest**2).sum(axis=1), _packed(*about)])


def _about(
    center: Floats, normals: Floats, firsts: Floats, seconds: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return integrals of n, x n, x x n / 2 about centres instead of the origin."""
    at_center = center[:, :, None] * normals[:, None]
    across = center[:, :, None, None] * (firsts - at_center / 2)[:, None]
    across = (across + across.transpose(0, 2, 1, 3)) / 2
    return normals, firsts - at_center, seconds - across


def _packed(normals: Floats, firsts: Floats, seconds: Floats) -> Floats:
    """Return the 22 coefficients that `_add_from_far` takes, in its order."""
    columns = [*normals.T, *(firsts[:, i, i] for i in range(3))]
    columns += [firsts[:, i, j] + firsts[:, j, i] for i, j in ((0, 1), (1, 2), (2, 0))]
    columns += list((np.einsum("bkki->bi", seconds) + 2 * np.einsum("bkik->bi", seconds)).T)
    columns += [seconds[:, i, i, i] for i in range(3)]
    for step in (1, 2):
        for i in range(3):
            j = (i + step) % 3
            columns.append(seconds[:, i, i, j] + 2 * seconds[:, i, j, i])
    mixed = seconds[:, 1, 2, 0] + seconds[:, 0, 2, 1] + seconds[:, 0, 1, 2]
    return np.column_stack([*columns, 2 * mixed])


@njit(nogil=True, cache=True)
def _solid_angles(
    first: Integers,
    corners: Floats,
    moments: Floats,
    x: Floats,
    y: Floats,
    z: Floats,
    cubes: Integers,
) -> Floats:
    """Return the solid angles of all faces from the points of some cubes, one cube after another."""
    waiting, leaves = np.zeros(DEEPEST, dtype=np.int64), len(first) - 1
    begin = cubes[0]
    angles = np.zeros(cubes[-1] - begin)
    for k in range(len(cubes) - 1):
        own = slice(cubes[k], cubes[k + 1])
        px, py, pz, sums = x[own], y[own], z[own], angles[cubes[k] - begin : cubes[k + 1] - begin]
        cx, cy, cz = (
            (px.min() + px.max()) / 2,
            (py.min() + py.max()) / 2,
            (pz.min() + pz.max()) / 2,
        )
        spread = np.sqrt(((px - cx) ** 2 + (py - cy) ** 2 + (pz - cz) ** 2).max())
        waiting[0], count = 0, 1
        while count > 0:
            count -= 1
            box = waiting[count]
            m = moments[box]
            away = np.sqrt((m[0] - cx) ** 2 + (m[1] - cy) ** 2 + (m[2] - cz) ** 2) - spread
            if away > FAR * np.sqrt(m[3]):
                _add_from_far(m, px, py, pz, sums)
            elif box >= leaves - 1:
                leaf = box - leaves + 1
                for row in range(first[leaf], first[leaf + 1]):
                    _add_solid_angles(corners[row], px, py, pz, sums)
            else:
                waiting[count], waiting[count + 1] = 2 * box + 2, 2 * box + 1
                count += 2
    return angles


@njit(nogil=True, cache=True, error_model="numpy")
def _add_from_far(m: Floats, px: Floats, py: Floats, pz: Floats, angles: Floats) -> None:
    """Add the solid angles of faces far from points, from their moments."""
    spread = m[7] + m[8] + m[9]
    for k in range(len(px)):
        x, y, z = m[0] - px[k], m[1] - py[k], m[2] - pz[k]
        one = m[4] * x + m[5] * y + m[6] * z
        two = x * (m[7] * x + m[10] * y + m[12] * z) + y * (m[8] * y + m[11] * z) + m[9] * z * z
        three = x * x * (m[16] * x + m[19] * y + m[22] * z)
        three += y * y * (m[17] * y + m[20] * z + m[23] * x)
        three += z * z * (m[18] * z + m[21] * x + m[24] * y) + m[25] * x * y * z
        near = 1 / (x * x + y * y + z * z)
        second = two + m[13] * x + m[14] * y + m[15] * z
        both = one + spread + 3 * near * (5 * near * three - second)
        angles[k] += both * near * np.sqrt(near)


@njit(nogil=True, cache=True, error_model="numpy")
def _add_solid_angles(corners: Floats, px: Floats, py: Floats, pz: Floats, angles: Floats) -> None:
    """Add the solid angle of a face from each of some points (Van Oosterom, Strackee)."""
    for k in range(len(px)):
        ax, ay, az = corners[0] - px[k], corners[1] - py[k], corners[2] - pz[k]
        bx, by, bz = corners[3] - px[k], corners[4] - py[k], corners[5] - pz[k]
        cx, cy, cz = corners[6] - px[k], corners[7] - py[k], corners[8] - pz[k]
        a = np.sqrt(ax * ax + ay * ay + az * az)
        b = np.sqrt(bx * bx + by * by + bz * bz)
        c = np.sqrt(cx * cx + cy * cy + cz * cz)
        volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        below = a * b * c + c * (ax * bx + ay * by + az * bz)
        below += a * (bx * cx + by * cy + bz * cz) + b * (cx * ax + cy * ay + cz * az)
        if volume != 0:  # else the point lies in the plane of the face, to neither side
            angles[k] += 2 * np.arctan2(volume, below)
