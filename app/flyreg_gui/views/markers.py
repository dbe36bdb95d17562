"""How landmarks look: the same colour and size in each view, by kind, weight and selection."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flyreg_core.correspondence import PlacedLandmark
from flyreg_gui.theme import KIND_COLORS, OFF, Color, Theme

Floats = NDArray[np.float64]

SELECTED_SIZE = 1.6
OFF_SIZE = 0.65
SIZE_PER_DECADE = 0.3
"""How much larger a landmark of ten times the weight is."""
SMALLEST, LARGEST = 0.6, 1.7


@dataclass(frozen=True, eq=False)
class MarkerStyle:
    """Ids, relative sizes and colours of landmarks, row by row."""

    ids: tuple[str, ...]
    names: tuple[str, ...]
    sizes: Floats  # (n,)
    colors: NDArray[np.uint8]  # (n, 3)
    is_selected: NDArray[np.bool_]  # (n,)

    def looks_like(self, other: MarkerStyle) -> bool:
        """Tell whether landmarks of another style would look the same."""
        return (self.ids, self.names) == (other.ids, other.names) and all(
            np.array_equal(mine, its)
            for mine, its in (
                (self.sizes, other.sizes),
                (self.colors, other.colors),
                (self.is_selected, other.is_selected),
            )
        )


def style_markers(
    landmarks: Sequence[PlacedLandmark],
    selected: Collection[str],
    theme: Theme,
    chosen: Mapping[str, Color] | None = None,
) -> MarkerStyle:
    """Return how landmarks look; `chosen` are colours by id instead of their own."""
    pairs = [landmark.pair for landmark in landmarks]
    is_selected = np.array([pair.id in selected for pair in pairs], dtype=bool)
    sizes = sizes_of(np.array([landmark.weight for landmark in landmarks]))
    if chosen is None:
        colors = [_color(landmark, theme) for landmark in landmarks]
    else:
        colors = [chosen.get(pair.id, OFF) for pair in pairs]
    array = np.array(colors, dtype=np.uint8).reshape(-1, 3)
    array[is_selected] = theme.selected
    sizes = np.where(is_selected, np.maximum(sizes, 1.0) * SELECTED_SIZE, sizes)
    ids, names = tuple(pair.id for pair in pairs), tuple(pair.short_name for pair in pairs)
    return MarkerStyle(ids, names, sizes, array, is_selected)


def _color(landmark: PlacedLandmark, theme: Theme) -> Color:
    """Return the landmark's own colour or that of its kind, faint for what is only suggested."""
    pair = landmark.pair
    if landmark.weight <= 0:
        return OFF
    color = pair.color or KIND_COLORS[pair.kind]
    if pair.origin != "suggested":
        return color
    red, green, blue = (
        (own + behind) // 2 for own, behind in zip(color, theme.background, strict=True)
    )
    return red, green, blue


def sizes_of(weights: Floats) -> Floats:
    """Return the relative sizes of landmarks' markers; 1 at weight 1."""
    decades = np.log10(weights, out=np.zeros(len(weights)), where=weights > 0)
    sizes = np.clip(1 + SIZE_PER_DECADE * decades, SMALLEST, LARGEST)
    return np.where(weights > 0, sizes, OFF_SIZE)


def points_of(places: Sequence[ArrayLike]) -> Floats:
    """Return places in space as an (n, 3) array, also if there is none."""
    return np.array(places, dtype=np.float64).reshape(-1, 3)
