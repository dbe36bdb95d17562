"""Which way a brain lies in its file: the axes of the animal among the axes of the coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flyreg_core.errors import InputError
from flyreg_core.mesh import Floats

FLATTEST = 1.2
"""How much deeper than tall a brain may be; some are about as deep as they are tall."""


@dataclass(frozen=True)
class BrainFrame:
    """The coordinate axis (0, 1 or 2) along which each axis of the animal runs.

    Coordinates grow towards the animal's left, ventrally and posteriorly, as in the images that
    the field's templates come from: the first slice is the most anterior, the first row the most
    dorsal, and whoever looks at it faces the fly.
    """

    left_right: int
    dorso_ventral: int
    antero_posterior: int

    @property
    def anterior(self) -> Floats:
        """Unit vector that points out of the front of the brain."""
        return np.asarray(-np.eye(3)[self.antero_posterior])

    @property
    def dorsal(self) -> Floats:
        """Unit vector that points out of the top of the brain."""
        return np.asarray(-np.eye(3)[self.dorso_ventral])


def find_frame(points: Floats) -> BrainFrame:
    """Return the frame of a brain: widest from left to right, thinnest from front to back.

    Parameters
    ----------
    points : (n, 3) float
        Points of the whole brain, micrometres.

    Raises
    ------
    InputError
        The brain is not widest along x, or clearly deeper (z) than tall (y): it lies turned.

    Notes
    -----
    Holds for every adult template of the field, with and without optic lobes.
    """
    extent = np.ptp(points, axis=0)
    if not (extent[0] > extent[1:].max() and extent[2] < FLATTEST * extent[1]):
        raise InputError(
            f"the brain lies turned in its file: it measures {extent[0]:.0f} x {extent[1]:.0f} x "
            f"{extent[2]:.0f} um along x, y and z; turn it so that x runs from its right to its left "
            "(longest), y from dorsal to ventral and z from front to back (shortest)"
        )
    return BrainFrame(0, 1, 2)
