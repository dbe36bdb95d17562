"""A spline for every smoothing: its values tabulated along the logarithm of lambda."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flyreg_core.cross_validation import Spectrum, find_spectrum
from flyreg_core.mesh import Floats
from flyreg_core.thin_plate_spline import affine_basis, kernel

LEAST_SMOOTHING, MOST_SMOOTHING = 1e-6, 10.0
NODES = 48
"""Values of lambda in the table: their error is below 1e-7 of the largest displacement."""

Evaluate = Callable[[Floats, Floats], Floats]
"""Values at all points of (k, d) bending and (3, d) affine parts."""


@dataclass(frozen=True, eq=False)
class SmoothingTable:
    """The values of a spline between `LEAST_SMOOTHING` and `MOST_SMOOTHING`, at Chebyshev nodes.

    Notes
    -----
    A smoothing lambda leaves a share lambda / (value + lambda) of each mode, a function of log
    lambda whose poles lie at a distance of pi from the real line whatever the value. Interpolation
    at N Chebyshev nodes over seven decades so errs by about 1.46^-N, for all modes alike.

    References
    ----------
    Berrut, Trefethen, Barycentric Lagrange interpolation, SIAM Review 46(3), 2004,
    doi:10.1137/S0036144502417715.
    """

    spectrum: Spectrum
    centers: Floats  # (k, 2)
    targets: Floats  # (k, 2)
    kernel: Floats  # (k, k)
    nodes: Floats  # (N,), logarithms of lambda
    first: Floats  # (n, 2), values at the first node
    steps: NDArray[np.float32]  # (N, 2 n), what the values at each node differ by from the first's

    @classmethod
    def make(
        cls, centers: Floats, targets: Floats, weights: Floats, evaluate: Evaluate
    ) -> SmoothingTable:
        """Return the table of (k, 2) landmarks, all of which weigh something."""
        spectrum = find_spectrum(centers, targets, weights)
        low, high = np.log(LEAST_SMOOTHING), np.log(MOST_SMOOTHING)
        angles = np.pi * np.arange(NODES) / (NODES - 1)
        nodes = (low + high) / 2 + (high - low) / 2 * np.cos(angles)
        bare = cls(
            *(spectrum, centers, targets, kernel(centers, centers), nodes),
            *(np.zeros((0, 2)), np.zeros((0, 0), dtype=np.float32)),
        )
        bending, affine = zip(
            *(bare.coefficients(float(np.exp(node))) for node in nodes), strict=True
        )
        values = evaluate(np.concatenate(bending, axis=1), np.concatenate(affine, axis=1))
        first = values[:, :2].copy()
        values -= np.tile(first, NODES)
        steps = values.reshape(len(first), NODES, 2).transpose(1, 0, 2).astype(np.float32)
        return cls(
            *(spectrum, centers, targets, bare.kernel, nodes), first, steps.reshape(NODES, -1)
        )

    def __call__(self, smoothing: float) -> Floats:
        """Return the (n, 2) values for a smoothing within the table."""
        away = np.log(smoothing) - self.nodes
        nearest = int(np.abs(away).argmin())
        shares = np.zeros(NODES)
        if away[nearest] == 0:
            shares[nearest] = 1.0
        else:
            pull = (-1.0) ** np.arange(NODES) / away
            pull[[0, -1]] /= 2
            shares = pull / pull.sum()
        step = shares.astype(np.float32) @ self.steps
        return np.asarray(self.first + step.reshape(self.first.shape))

    def coefficients(self, smoothing: float) -> tuple[Floats, Floats]:
        """Return the (k, 2) bending and the (3, 2) affine part of the spline, exactly."""
        spectrum, roots = self.spectrum, self.spectrum.root_weights[:, np.newaxis]
        shares = spectrum.amounts / (spectrum.values + smoothing)[:, np.newaxis]
        bending = roots * (spectrum.modes @ shares)
        flat = self.targets - self.kernel @ bending - smoothing * bending / roots**2
        affine = np.linalg.lstsq(roots * affine_basis(self.centers), roots * flat)[0]
        return bending, np.asarray(affine, float)
