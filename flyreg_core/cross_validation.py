"""How well landmarks foretell each other: leave-one-out errors, and the smoothing they speak for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flyreg_core.mesh import Booleans, Floats
from flyreg_core.thin_plate_spline import LEAST_WEIGHT, affine_basis, kernel

SMOOTHINGS = np.geomspace(1e-6, 1e2, 65)
"""Values of lambda that are compared."""
AS_GOOD = 1.05
"""Landmarks are foretold as well by two smoothings whose errors differ by less than this factor."""
AGREED = 1e-9
"""Landmarks foretold to this share of the domain's width, up to rounding, leave nothing to smooth."""


@dataclass(frozen=True, eq=False)
class Spectrum:
    """The misfit of weighted landmarks to their spline, for every smoothing at once.

    Of landmarks whose targets are scaled by the roots of their weights, a smoothing lambda leaves
    `modes` lambda / (values + lambda) `amounts`.
    """

    is_used: Booleans  # (n,) landmarks that have a weight
    root_weights: Floats  # (k,)
    values: Floats  # (m,), at least 0
    modes: Floats  # (k, m)
    amounts: Floats  # (m, 2)


@dataclass(frozen=True)
class Advice:
    """A smoothing to take, or none, and why."""

    smoothing: float | None
    reason: str  # for the user


FALLS_TO_THE_END = (
    "Cross-validation speaks for no smoothing: the landmarks foretell each other the better the "
    "less the spline bends, to the end of the scale. Most of them say what their neighbours say; "
    "to smooth so much would ignore what a single one says alone."
)
ALL_AGREE = (
    "Cross-validation speaks for no smoothing: each landmark lies already where all others put it, "
    "so that every smoothing gives the same."
)
FLAT = (
    "Cross-validation speaks for no other smoothing: with the present one the landmarks foretell "
    "each other as well as with any other."
)
FORETELLS_BEST = (
    "The smoothing with which the landmarks foretell each other best; it smooths away what a "
    "single landmark says alone."
)


@dataclass(frozen=True, eq=False)
class CrossValidation:
    """How badly splines of several smoothings foretell landmarks, in squares of the domain's width."""

    smoothings: Floats  # (s,)
    scores: Floats  # (s,)

    @property
    def best(self) -> float:
        """The smoothing with the least score."""
        return float(self.smoothings[np.argmin(self.scores)])

    def error_at(self, smoothing: float) -> float:
        """Return how many times as far off a smoothing foretells landmarks as the best one."""
        scores = np.log(np.maximum(self.scores, np.finfo(float).tiny))
        place = np.log(max(smoothing, float(self.smoothings[0])))
        score = float(np.interp(place, np.log(self.smoothings), scores))
        return float(np.exp((score - scores.min()) / 2))

    def advise(self, smoothing: float) -> Advice:
        """Return the smoothing to take instead of the present one, if the curve speaks for one.

        It speaks for none where it falls to the end of the scale: there the spline is an affine
        map, which foretells landmarks as well as any other if most of them say what their
        neighbours say, and lets none of them have its way. Nor where it is flat, or but rounding.
        """
        if self.scores.min() < AGREED**2:
            return Advice(None, ALL_AGREE)
        if self.error_at(float(self.smoothings[-1])) < AS_GOOD:
            return Advice(None, FALLS_TO_THE_END)
        if self.error_at(smoothing) < AS_GOOD:
            return Advice(None, FLAT)
        return Advice(self.best, FORETELLS_BEST)


def find_spectrum(sources: Floats, targets: Floats, weights: Floats) -> Spectrum:
    """Return the spectrum of (n, 2) landmarks with (n,) weights; sources lie not all on one line.

    Notes
    -----
    With B = W^1/2 K W^1/2 and Z spanning what is perpendicular to W^1/2 P, the misfit of (K + lambda
    W^-1) w + P a = q is lambda W^-1 w = lambda W^-1/2 Z (Z^T B Z + lambda)^-1 Z^T W^1/2 q. O(n^3).

    References
    ----------
    Wahba, Spline Models for Observational Data, SIAM 1990, chapter 4.
    """
    is_used = weights > LEAST_WEIGHT
    root = np.sqrt(weights[is_used])
    centers, goals = sources[is_used], targets[is_used]
    basis = root[:, np.newaxis] * affine_basis(centers)
    across = np.linalg.qr(basis, mode="complete")[0][:, basis.shape[1] :]
    bent = across.T @ (root[:, np.newaxis] * kernel(centers, centers) * root) @ across
    values, vectors = np.linalg.eigh(bent)
    modes = across @ vectors
    amounts = modes.T @ (root[:, np.newaxis] * goals)
    return Spectrum(is_used, root, np.maximum(values, 0.0), modes, amounts)


def misfits(spectrum: Spectrum, smoothing: float) -> Floats:
    """Return (n, 2) targets less where the spline takes the sources; NaN if a landmark is not used."""
    left = _left(spectrum, smoothing)[:, np.newaxis] * spectrum.amounts
    missed = np.full((len(spectrum.is_used), left.shape[1]), np.nan)
    missed[spectrum.is_used] = spectrum.modes @ left / spectrum.root_weights[:, np.newaxis]
    return missed


def bending_energy(spectrum: Spectrum, smoothing: float) -> float:
    """Return w^T K w of the spline, of both coordinates together: how much it bends the plane.

    With the amounts divided by (values + lambda), w is W^1/2 Z of them, and Z^T B Z is diagonal.
    """
    total = (spectrum.values + smoothing)[:, np.newaxis]
    bent = np.divide(spectrum.amounts, total, out=np.zeros_like(spectrum.amounts), where=total > 0)
    return float(spectrum.values @ (bent**2).sum(axis=1))


def leave_one_out(spectrum: Spectrum, smoothing: float) -> Floats:
    """Return (n, 2) targets less where the spline of all others takes the sources; NaN if not used.

    One landmark that is left out moves its misfit by 1 / (1 - its leverage): no spline is fitted
    anew. Where nothing is foretold without a landmark, the error is infinite.
    """
    freedom = (spectrum.modes**2) @ _left(spectrum, smoothing)  # 1 less the leverage
    errors = misfits(spectrum, smoothing)
    with np.errstate(divide="ignore", invalid="ignore"):
        own = errors[spectrum.is_used] / freedom[:, np.newaxis]
    errors[spectrum.is_used] = np.where(freedom[:, np.newaxis] > 0, own, np.inf)
    return errors


def leverages(spectrum: Spectrum, smoothing: float) -> Floats:
    """Return by how much each target (n,) draws its own source's image along, 0 to 1; NaN if not used.

    The diagonal of the matrix that takes targets to the spline's values at the sources; 1 is a
    landmark that only itself decides about.
    """
    shares = np.full(len(spectrum.is_used), np.nan)
    shares[spectrum.is_used] = 1 - (spectrum.modes**2) @ _left(spectrum, smoothing)
    return np.asarray(np.clip(shares, 0.0, 1.0))


def cross_validate(spectra: Sequence[Spectrum]) -> CrossValidation:
    """Return the generalised cross-validation of a smoothing that several splines share.

    References
    ----------
    Craven, Wahba, Smoothing noisy data with spline functions, Numerische Mathematik 31, 1979,
    doi:10.1007/BF01404567.
    """
    count = sum(len(spectrum.root_weights) for spectrum in spectra)
    scores = []
    for smoothing in SMOOTHINGS:
        left = [_left(spectrum, float(smoothing)) for spectrum in spectra]
        misfit = sum(
            float(((share[:, np.newaxis] * spectrum.amounts) ** 2).sum())
            for share, spectrum in zip(left, spectra, strict=True)
        )
        freedom = sum(float(share.sum()) for share in left)
        scores.append(count * misfit / max(freedom, np.finfo(float).tiny) ** 2)
    return CrossValidation(SMOOTHINGS, np.array(scores))


def _left(spectrum: Spectrum, smoothing: float) -> Floats:
    """Return which share of each mode a spline leaves."""
    total = spectrum.values + smoothing
    return np.divide(smoothing, total, out=np.zeros_like(total), where=total > 0)
