"""Which way flat triangles turn, decided exactly."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numba import njit

from flyreg_core.mesh import Booleans, FlatMesh, Floats, Integers

ROUNDING = 2.0**-52
SPLITTER = 2.0**27 + 1
"""Times a number, and less what that is too much: its upper half (Dekker)."""
TINY, HUGE = 1e-250, 1e250
"""Products outside lose digits, so that only fractions are exact."""
UNDECIDED = 2


def signed_areas(corners: Floats) -> Floats:
    """Return the (m,) areas of (m, 3, 2) triangles, negative where clockwise, as rounded."""
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]) / 2


def orientations(corners: Floats) -> Integers:
    """Return the exact signs, 1, 0 or -1, of the areas of (m, 3, 2) triangles.

    Notes
    -----
    The rounded determinant decides where its size exceeds its error bound; the others are summed
    without rounding, as expansions, or where digits would be lost below the smallest numbers, as
    fractions. All are exact for the given floating-point coordinates.

    References
    ----------
    Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric predicates,
    Discrete and Computational Geometry 18, 1997, doi:10.1007/PL00009321 (the bound of `ccw`).
    """
    signs = _signs(np.ascontiguousarray(corners))
    for face in np.flatnonzero(signs == UNDECIDED):
        signs[face] = _sign_by_fractions(corners[face])
    return signs


def face_orientations(flat: FlatMesh, chosen: Integers | None = None) -> Integers:
    """Return the exact signs of the areas of the faces of a half laid flat, or of some of them."""
    chosen = np.arange(len(flat.faces)) if chosen is None else chosen
    signs = signs_of_faces(flat.uv, flat.faces, flat.corner_shifts, chosen)
    for place in np.flatnonzero(signs == UNDECIDED):
        face = chosen[place]
        corners = flat.uv[flat.faces[face]]
        corners[:, 0] += flat.corner_shifts[face]
        signs[place] = _sign_by_fractions(corners)
    return signs


def flipped_faces(flat: FlatMesh) -> Booleans:
    """Tell which faces of a half laid flat are flipped or have no area, decided exactly."""
    flipped = _are_flipped(flat.uv, flat.faces, flat.corner_shifts)
    suspects = np.flatnonzero(flipped)
    flipped[suspects] = face_orientations(flat, suspects) <= 0
    return flipped


def _sign_by_fractions(corners: Floats) -> int:
    (ax, ay), (bx, by), (cx, cy) = ((Fraction(float(x)), Fraction(float(y))) for x, y in corners)
    determinant = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return (determinant > 0) - (determinant < 0)


@njit(nogil=True, cache=True)
def _signs(corners: Floats) -> Integers:
    signs = np.zeros(len(corners), dtype=np.int64)
    for k in range(len(corners)):
        signs[k] = sign_of_triangle(
            corners[k, 0, 0],
            corners[k, 0, 1],
            corners[k, 1, 0],
            corners[k, 1, 1],
            corners[k, 2, 0],
            corners[k, 2, 1],
        )
    return signs


@njit(nogil=True, cache=True)
def signs_of_faces(uv: Floats, faces: Integers, shifts: Integers, chosen: Integers) -> Integers:
    """Return the signs of some faces; `UNDECIDED` where only fractions are exact."""
    signs = np.zeros(len(chosen), dtype=np.int64)
    for k in range(len(chosen)):
        face = chosen[k]
        a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
        signs[k] = sign_of_triangle(
            uv[a, 0] + shifts[face, 0],
            uv[a, 1],
            uv[b, 0] + shifts[face, 1],
            uv[b, 1],
            uv[c, 0] + shifts[face, 2],
            uv[c, 1],
        )
    return signs


@njit(nogil=True, cache=True)
def _are_flipped(uv: Floats, faces: Integers, shifts: Integers) -> Booleans:
    """Tell which faces are flipped or cannot be told, by the rounded determinant alone."""
    flipped = np.zeros(len(faces), dtype=np.bool_)
    for face in range(len(faces)):
        a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
        ax, ay = uv[a, 0] + shifts[face, 0], uv[a, 1]
        bx, by = uv[b, 0] + shifts[face, 1] - ax, uv[b, 1] - ay
        cx, cy = uv[c, 0] + shifts[face, 2] - ax, uv[c, 1] - ay
        plus, minus = bx * cy, by * cx
        flipped[face] = not plus - minus > 4 * ROUNDING * (abs(plus) + abs(minus)) + TINY
    return flipped


@njit(nogil=True, cache=True)
def sign_of_triangle(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> int:
    """Return the exact sign of the area of one triangle; `UNDECIDED` where digits would be lost."""
    plus, minus = (bx - ax) * (cy - ay), (by - ay) * (cx - ax)
    determinant = plus - minus
    if abs(determinant) > 4 * ROUNDING * (abs(plus) + abs(minus)) + TINY:
        return 1 if determinant > 0 else -1
    parts = np.array(
        [
            bx - ax,
            _lost(bx, ax),
            cy - ay,
            _lost(cy, ay),
            by - ay,
            _lost(by, ay),
            cx - ax,
            _lost(cx, ax),
        ]
    )
    total = np.zeros(16)
    count = 0
    for sense, first, second in ((1.0, 0, 2), (-1.0, 4, 6)):
        for i in range(2):
            for j in range(2):
                one, other = sense * parts[first + i], parts[second + j]
                product = one * other
                if one != 0 and other != 0 and not TINY < abs(product) < HUGE:
                    return UNDECIDED
                count = _add(total, count, _lost_by_product(one, other, product))
                count = _add(total, count, product)
    for k in range(15, -1, -1):
        if total[k] != 0:
            return 1 if total[k] > 0 else -1
    return 0


@njit(nogil=True, cache=True)
def _lost(a: float, b: float) -> float:
    """Return a - b less its rounded value, exactly (Knuth)."""
    difference = a - b
    virtual = a - difference
    return (a - (difference + virtual)) + (virtual - b)


@njit(nogil=True, cache=True)
def _lost_by_product(a: float, b: float, product: float) -> float:
    """Return a b less its rounded value, exactly (Dekker)."""
    upper_a, upper_b = SPLITTER * a, SPLITTER * b
    upper_a -= upper_a - a
    upper_b -= upper_b - b
    lower_a, lower_b = a - upper_a, b - upper_b
    error = product - upper_a * upper_b - lower_a * upper_b - upper_a * lower_b
    return lower_a * lower_b - error


@njit(nogil=True, cache=True)
def _add(total: Floats, count: int, value: float) -> int:
    """Add a number to an expansion, its parts growing and none overlapping (grow-expansion)."""
    for k in range(count):
        rest = total[k]
        sum_ = value + rest
        virtual = sum_ - value
        total[k] = (value - (sum_ - virtual)) + (rest - virtual)
        value = sum_
    total[count] = value
    return count + 1
