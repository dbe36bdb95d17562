"""Which way flat triangles turn, decided exactly."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from flyreg_core.mesh import Floats, Integers

ROUNDING = 2.0**-52


def signed_areas(corners: Floats) -> Floats:
    """Return the (m,) areas of (m, 3, 2) triangles, negative where clockwise, as rounded."""
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]) / 2


def orientations(corners: Floats) -> Integers:
    """Return the exact signs, 1, 0 or -1, of the areas of (m, 3, 2) triangles.

    Notes
    -----
    The rounded determinant decides where its size exceeds its error bound; the others are
    computed with fractions, which are exact for the given floating-point coordinates.

    References
    ----------
    Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric predicates,
    Discrete and Computational Geometry 18, 1997, doi:10.1007/PL00009321 (the bound of `ccw`).
    """
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    plus, minus = ab[:, 0] * ac[:, 1], ab[:, 1] * ac[:, 0]
    determinant = plus - minus
    signs = np.sign(determinant).astype(np.int64)
    doubtful = np.abs(determinant) <= 4 * ROUNDING * (np.abs(plus) + np.abs(minus))
    for face in np.flatnonzero(doubtful):
        signs[face] = _exact_sign(corners[face])
    return signs


def _exact_sign(corners: Floats) -> int:
    (ax, ay), (bx, by), (cx, cy) = ((Fraction(float(x)), Fraction(float(y))) for x, y in corners)
    determinant = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return (determinant > 0) - (determinant < 0)
