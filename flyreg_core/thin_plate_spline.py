"""Stage 6: the weighted smoothing spline that carries flat source landmarks to flat target ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from flyreg_core.errors import LandmarkError
from flyreg_core.mesh import Floats

LEAST_WEIGHT = 1e-12
"""A smaller weight counts as 0: its inverse would drown the rest of the system in rounding."""


@dataclass(frozen=True, eq=False)
class ThinPlateSpline:
    """A fitted spline: affine part plus one bump per landmark in use (eq. 6)."""

    centers: Floats  # (k, 2) or (k, 3), all landmarks
    bending: Floats  # (k, d), w of eq. 7; 0 for a landmark that is left out
    affine: Floats  # (d + 1, d), alpha of eq. 7

    def __call__(self, points: Floats) -> Floats:
        """Return where (n, d) points go."""
        return self.from_kernel(kernel(points, self.centers), points)

    def from_kernel(self, kernel_at_points: Floats, points: Floats) -> Floats:
        """Return where points go whose (n, k) kernel to the centers is known already."""
        return np.asarray(kernel_at_points @ self.bending + affine_basis(points) @ self.affine)


def fit_thin_plate_spline(
    sources: Floats, targets: Floats, weights: Floats, smoothing: float
) -> ThinPlateSpline:
    """Fit the smoothest map that brings `sources` near `targets`.

    Parameters
    ----------
    sources, targets : (k, 2) or (k, 3) float
        Landmark positions; row i of both is one pair. Lengths in a domain of width near 1, so that
        lambda means the same for every brain.
    weights : (k,) float
        How strongly each pair pulls, at least 0; a pair of weight 0 is left out.
    smoothing : float
        Lambda, at least 0. 0 passes through every target; very large gives the weighted affine fit.

    Raises
    ------
    LandmarkError
        The landmarks in use lie on one line (in a plane, in 3-D), two of them at the same place for
        lambda = 0, or a weight or lambda is negative or not a number.

    Notes
    -----
    Solves (K + lambda W^-1) w + P a = q, P^T w = 0 (eq. 8, 10), uniquely if P has full column rank
    and, for lambda = 0, the landmarks are distinct. The diagonal of W^-1 is 1 / weight: the more a
    pair weighs, the closer the spline passes. Affine maps are reproduced for every lambda. O(k^3).

    References
    ----------
    3.2 of the paper. Bookstein, Principal warps, IEEE PAMI 11(6), 1989, doi:10.1109/34.24792.
    Wahba, Spline Models for Observational Data, SIAM 1990.
    """
    check_landmarks(sources, targets, weights, smoothing)
    used = weights > LEAST_WEIGHT
    system = make_system(sources[used], weights[used], smoothing)
    n, m = used.sum(), sources.shape[1] + 1
    right = np.vstack([targets[used], np.zeros((m, targets.shape[1]))])
    solution = np.linalg.solve(system, right)
    bending = np.zeros(sources.shape)
    bending[used] = solution[:n]
    return ThinPlateSpline(sources, bending, solution[n:])


def check_landmarks(sources: Floats, targets: Floats, weights: Floats, smoothing: float) -> None:
    """Raise what `fit_thin_plate_spline` raises for landmarks that no spline can be fitted to."""
    if sources.shape != targets.shape:
        raise LandmarkError(f"{len(sources)} source landmarks but {len(targets)} target landmarks")
    if not (np.isfinite(weights).all() and (weights >= 0).all()):
        raise LandmarkError("a weight is negative or not a number; use 0 to leave a landmark out")
    if not (np.isfinite(smoothing) and smoothing >= 0):
        raise LandmarkError(f"the smoothing must be 0 or a positive number, not {smoothing}")
    centers = sources[weights > LEAST_WEIGHT]
    basis = affine_basis(centers)
    if np.linalg.matrix_rank(basis) < basis.shape[1]:
        raise LandmarkError("the landmarks in use lie on one line; add one beside it")
    if smoothing == 0 and len(np.unique(centers, axis=0)) < len(centers):
        raise LandmarkError("two landmarks in use lie at the same place; raise lambda or drop one")


def make_system(centers: Floats, weights: Floats, smoothing: float) -> Floats:
    """Return the matrix of eq. 10 for (k, d) landmarks of positive weight, bordered by (k, d + 1) P."""
    matrix = kernel(centers, centers) + np.diag(smoothing / weights)
    basis = affine_basis(centers)
    m = basis.shape[1]
    return np.block([[matrix, basis], [basis.T, np.zeros((m, m))]])


def kernel(points: Floats, centers: Floats) -> Floats:
    """Return the (n, k) kernel: r^2 log r^2 in the plane (eq. 9), -r in space (+r is unstable)."""
    if points.shape[1] == 3:
        return -cdist(points, centers)
    squared = cdist(points, centers, "sqeuclidean")
    return squared * np.log(squared, out=np.zeros_like(squared), where=squared > 0)


def affine_basis(points: Floats) -> Floats:
    """Return the (n, d + 1) columns 1, x, y that affine maps are made of, P of eq. 8."""
    return np.column_stack([np.ones(len(points)), points])
