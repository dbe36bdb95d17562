"""A spline for every smoothing: its values tabulated along the logarithm of lambda."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flyreg_core.cross_validation import Spectrum, find_spectrum
from flyreg_core.mesh import Floats
from flyreg_core.thin_plate_spline import affine_basis, kernel

LEAST_SMOOTHING, MOST_SMOOTHING = 1e-6, 10.0
STEPS = 64
"""Of the logarithm of lambda between the two, all equal."""
AROUND = 8
"""Nodes around a lambda between which it is interpolated; more lie beyond both ends."""
BEYOND = AROUND // 2 - 1
N_NODES = STEPS + 1 + 2 * BEYOND
STEP = float(np.log(MOST_SMOOTHING / LEAST_SMOOTHING)) / STEPS

Evaluate = Callable[[Floats, Floats], Floats]
"""Values at all points of (k, d) bending and (3, d) affine parts."""


@dataclass(frozen=True, eq=False)
class SmoothingTable:
    """The values of a spline at equal steps of log lambda, and what lies between them.

    Notes
    -----
    A smoothing lambda leaves a share lambda / (value + lambda) of each mode, a function of log
    lambda whose poles lie at a distance of pi from the real line whatever the value. Lagrange's
    polynomial through 8 nodes at steps h = ln(10^7) / 64 around a lambda so errs by at most about
    43 (h / pi)^8 = 8e-8 of what the smoothing does, for all modes alike.
    """

    spectrum: Spectrum
    centers: Floats  # (k, 2)
    targets: Floats  # (k, 2)
    kernel: Floats  # (k, k)
    to_affine: Floats  # (3, k), takes weighted heights of a plane to the plane
    first: Floats  # (n, 2), values at the first node
    steps: NDArray[np.float32]  # (N, 2 n), what the values at each node differ by from the first's

    @classmethod
    def make(
        cls, centers: Floats, targets: Floats, weights: Floats, evaluate: Evaluate
    ) -> SmoothingTable:
        """Return the table of (k, 2) landmarks, all of which weigh something."""
        spectrum = find_spectrum(centers, targets, weights)
        plane = spectrum.root_weights[:, np.newaxis] * affine_basis(centers)
        bare = cls(
            *(
                spectrum,
                centers,
                targets,
                kernel(centers, centers),
                np.asarray(np.linalg.pinv(plane), float),
            ),
            *(np.zeros((0, 2)), np.zeros((0, 0), dtype=np.float32)),
        )
        nodes = [LEAST_SMOOTHING * float(np.exp(STEP * (k - BEYOND))) for k in range(N_NODES)]
        bending, affine = zip(*(bare.coefficients(node) for node in nodes), strict=True)
        values = evaluate(np.concatenate(bending, axis=1), np.concatenate(affine, axis=1))
        first = values[:, :2].copy()
        values -= np.tile(first, N_NODES)
        steps = values.reshape(len(first), N_NODES, 2).transpose(1, 0, 2).astype(np.float32)
        return replace(bare, first=first, steps=steps.reshape(N_NODES, -1))

    def __call__(self, smoothing: float) -> Floats:
        """Return the (n, 2) values for a smoothing within the table."""
        place = np.log(smoothing / LEAST_SMOOTHING) / STEP + BEYOND
        start = min(max(int(place) - AROUND // 2 + 1, 0), N_NODES - AROUND)
        nodes = np.arange(AROUND)
        away = place - start - nodes
        shares = [
            np.prod(np.delete(away, k)) / np.prod(np.delete(k - nodes, k)) for k in range(AROUND)
        ]
        step = np.array(shares, dtype=np.float32) @ self.steps[start : start + AROUND]
        return np.asarray(self.first + step.reshape(self.first.shape))

    def coefficients(self, smoothing: float) -> tuple[Floats, Floats]:
        """Return the (k, 2) bending and the (3, 2) affine part of the spline, exactly."""
        spectrum, roots = self.spectrum, self.spectrum.root_weights[:, np.newaxis]
        shares = spectrum.amounts / (spectrum.values + smoothing)[:, np.newaxis]
        bending = roots * (spectrum.modes @ shares)
        flat = self.targets - self.kernel @ bending - smoothing * bending / roots**2
        return bending, np.asarray(self.to_affine @ (roots * flat))
