"""What passing close to the landmarks costs in bending: the L-curve of the smoothing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from flyreg_core.cross_validation import SMOOTHINGS, Spectrum, bending_energy, misfits
from flyreg_core.mesh import Floats


@dataclass(frozen=True, eq=False)
class TradeOff:
    """Residual and bending energy for each smoothing: less of one is more of the other."""

    smoothings: Floats  # (s,), growing
    residuals_um: Floats  # (s,), root mean square, each landmark counting as much as it weighs
    energies: Floats  # (s,), w^T K w of the splines in the rectangle, which has no unit

    def at(self, smoothing: float) -> tuple[float, float]:
        """Return residual and bending energy at a smoothing; beyond the scale those of its ends."""
        known = np.log(self.smoothings)
        place = np.log(max(smoothing, float(self.smoothings[0])))
        residual, energy = (
            float(np.interp(place, known, values)) for values in (self.residuals_um, self.energies)
        )
        return residual, energy


def weighted_squares(
    spectrum: Spectrum, targets: Floats, points: Floats, lift: Callable[[Floats], Floats]
) -> Floats:
    """Return for each smoothing the sum of the landmarks' weights times their squared residuals, um^2.

    Parameters
    ----------
    targets : (n, 2) float
        Where the landmarks should come to lie in the rectangle.
    points : (n, 3) float
        The same places on the surface, micrometres.
    lift : callable
        From (k, 2) places of the rectangle to (k, 3) points of the surface.
    """
    used = spectrum.is_used
    places = np.stack([targets[used] - misfits(spectrum, value)[used] for value in SMOOTHINGS])
    lifted = lift(places.reshape(-1, 2)).reshape(len(SMOOTHINGS), -1, 3)
    squares = ((lifted - points[used]) ** 2).sum(axis=-1)
    return np.asarray(squares @ spectrum.root_weights**2)


def find_trade_off(spectra: Sequence[Spectrum], squares: Sequence[Floats]) -> TradeOff:
    """Return the L-curve of splines that share a smoothing, from the `weighted_squares` of each.

    References
    ----------
    Hansen, Analysis of discrete ill-posed problems by means of the L-curve, SIAM Review 34(4), 1992,
    doi:10.1137/1034115.
    """
    weight = sum(float((spectrum.root_weights**2).sum()) for spectrum in spectra)
    energies = [
        sum(bending_energy(spectrum, float(value)) for spectrum in spectra) for value in SMOOTHINGS
    ]
    return TradeOff(SMOOTHINGS, np.sqrt(np.sum(squares, axis=0) / weight), np.array(energies))
