"""Colours for quantities: even steps of a value look even, also to the colour-blind and in grey."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flyreg_core.mesh import Floats

Color = tuple[int, int, int]
Colors = NDArray[np.uint8]

SOURCE: Color = (120, 160, 196)
TARGET: Color = (216, 178, 120)
"""Of the two brains, wherever both are shown."""


@dataclass(frozen=True)
class ColorMap:
    """Colours at equal steps from the least to the greatest value, and straight between them."""

    name: str
    anchors: tuple[Color, ...]

    def __call__(self, shares: Floats) -> Colors:
        """Return (n, 3) colours of (n,) shares of the way from least to greatest, clipped to 0..1."""
        steps = np.linspace(0.0, 1.0, len(self.anchors))
        channels = np.array(self.anchors, dtype=float).T
        mixed = [np.interp(shares, steps, channel) for channel in channels]
        return np.asarray(np.round(np.stack(mixed, axis=-1)), dtype=np.uint8)


# Seventeen colours of viridis by Smith and van der Walt, given to the public (CC0) in 2015; what lies
# between them is within 6 of 255 of the original.
VIRIDIS = ColorMap(
    "viridis",
    (
        (68, 1, 84),
        (72, 24, 106),
        (71, 45, 123),
        (66, 64, 134),
        (59, 82, 139),
        (51, 99, 141),
        (44, 114, 142),
        (38, 129, 142),
        (33, 144, 140),
        (31, 159, 136),
        (40, 174, 128),
        (62, 188, 116),
        (93, 201, 99),
        (130, 211, 76),
        (171, 220, 50),
        (213, 226, 26),
        (253, 231, 37),
    ),
)


def colors_of(values: Floats, low: float, high: float, color_map: ColorMap = VIRIDIS) -> Colors:
    """Return (n, 3) colours of (n,) values between `low` and `high`; beyond, those of the ends."""
    span = high - low
    shares = (values - low) / span if span > 0 else np.zeros_like(values)
    return color_map(shares)


# Straight lines in Oklab (Ottosson 2020) from light grey to a dark blue and a dark brown of equal
# lightness: apart for each kind of colour blindness, and even steps of a value look even.
BLUE_BROWN = ColorMap(
    "blue to brown",
    (
        (16, 75, 146),
        (48, 96, 158),
        (75, 116, 170),
        (101, 136, 182),
        (128, 156, 194),
        (155, 176, 206),
        (182, 197, 217),
        (210, 217, 228),
        (238, 238, 238),
        (224, 214, 209),
        (210, 191, 181),
        (196, 168, 153),
        (181, 145, 125),
        (167, 122, 98),
        (152, 100, 71),
        (136, 78, 44),
        (121, 56, 9),
    ),
)
"""For quantities around 0."""
