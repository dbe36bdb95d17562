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

    first: Floats  # (n, 2), values at the first node
    steps: NDArray[np.float32]  # (N, 2 n), what the values at each node differ by from the first's

    @classmethod
    def make(
        cls, centers: Floats, targets: Floats, weights: Floats, evaluate: Evaluate
    ) -> SmoothingTable:
        """Return the table of (k, 2) landmarks, all of which weigh something."""
        spectrum = find_spectrum(centers, targets, weights)
        nodes = [LEAST_SMOOTHING * float(np.exp(STEP * (k - BEYOND))) for k in range(N_NODES)]
        bending, affine = _coefficients(centers, targets, spectrum, np.array(nodes))
        values = evaluate(bending, affine)
        first = values[:, :2].copy()
        values -= np.tile(first, N_NODES)
        steps = values.reshape(len(first), N_NODES, 2).transpose(1, 0, 2).astype(np.float32)
        return cls(first, steps.reshape(N_NODES, -1))

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


def _coefficients(
    centers: Floats, targets: Floats, spectrum: Spectrum, smoothings: Floats
) -> tuple[Floats, Floats]:
    """Return the (k, 2 s) bending and (3, 2 s) affine parts of the splines of s smoothings."""
    roots = spectrum.root_weights[:, np.newaxis]
    left = spectrum.values[:, np.newaxis] + smoothings
    shares = (spectrum.amounts[:, np.newaxis] / left[..., np.newaxis]).reshape(len(left), -1)
    scaled = spectrum.modes @ shares
    bending = roots * scaled
    flat = np.tile(targets, len(smoothings)) - kernel(centers, centers) @ bending
    flat -= np.repeat(smoothings, 2) * scaled / roots
    affine = np.linalg.lstsq(roots * affine_basis(centers), roots * flat)[0]
    return bending, np.asarray(affine, float)
