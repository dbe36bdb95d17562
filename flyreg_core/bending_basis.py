"""Functions of space that a displacement is made of: a spline in space with kernel -r."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.spatial.distance import cdist

from flyreg_core.mesh import Floats
from flyreg_core.spread_out import spread_out

CENTERS = 300
"""Places at which space can be bent."""
N_AFFINE = 4
"""Functions that bend nothing: 1, x, y and z."""


@dataclass(frozen=True, eq=False)
class BendingBasis:
    """Functions of space: 1, x, y, z and bumps whose squared coefficients add up to bending energy."""

    centers: Floats  # (k, 3)
    middle: Floats  # (3,)
    scale: float  # micrometres, the length that counts as 1
    modes: Floats  # (k, k - 4)

    def __call__(self, points: Floats) -> Floats:
        """Return (n, k) values at (n, 3) points."""
        values = np.zeros((len(points), N_AFFINE + self.modes.shape[1]))
        values[:, 0] = 1
        values[:, 1:N_AFFINE] = (points - self.middle) / self.scale
        np.matmul(cdist(points, self.centers), self.modes / -self.scale, out=values[:, N_AFFINE:])
        return values

    def combined(self, points: Floats, coefficients: Floats) -> Floats:
        """Return `self(points) @ coefficients`, (n, 3), without the table of all values.

        Parameters
        ----------
        coefficients : (k', 3) float
            Of the first k' functions; the rest count 0.
        """
        smooth, bumps = coefficients[:N_AFFINE], coefficients[N_AFFINE:]
        of_centers = self.modes[:, : len(bumps)] @ bumps / -self.scale
        result = smooth[0] + (points - self.middle) / self.scale @ smooth[1:]
        _add_distances(points, self.centers, of_centers, result)
        return np.asarray(result)

    def moved(self, points: Floats, coefficients: Floats) -> Floats:
        """Return where a displacement with (k', 3) coefficients takes (n, 3) points."""
        return np.asarray(points + self.combined(points, coefficients))


def make_basis(points: Floats) -> BendingBasis:
    """Return a basis with centers spread out over (n, 3) points, the smoothest bumps first."""
    centers = points[spread_out(points, CENTERS)]
    scale = float(np.ptp(points, axis=0).max())
    middle = centers.mean(axis=0)
    affine = np.column_stack([np.ones(len(centers)), (centers - middle) / scale])
    complement = np.linalg.qr(affine, mode="complete")[0][:, N_AFFINE:]
    energy = complement.T @ (-cdist(centers, centers) / scale) @ complement
    values, vectors = np.linalg.eigh(energy)  # positive: -r is conditionally so
    smoothest_first = (vectors / np.sqrt(values))[:, ::-1]
    return BendingBasis(centers, middle, scale, complement @ smoothest_first)


@njit(nogil=True, cache=True, fastmath={"reassoc", "contract"})
def _add_distances(points: Floats, centers: Floats, weights: Floats, result: Floats) -> None:
    """Add to an (n, 3) result the distances of (n, 3) points to (k, 3) centers, weighted (k, 3)."""
    x, y, z = centers[:, 0].copy(), centers[:, 1].copy(), centers[:, 2].copy()
    u, v, w = weights[:, 0].copy(), weights[:, 1].copy(), weights[:, 2].copy()
    for row in range(len(points)):
        first = second = third = 0.0
        for k in range(len(x)):
            a, b, c = points[row, 0] - x[k], points[row, 1] - y[k], points[row, 2] - z[k]
            distance = np.sqrt(a * a + b * b + c * c)
            first += u[k] * distance
            second += v[k] * distance
            third += w[k] * distance
        result[row, 0] += first
        result[row, 1] += second
        result[row, 2] += third
