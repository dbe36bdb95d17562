"""What landmarks are coloured by: their kind, or how well they fit, or how strongly they pull."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from PySide6.QtCore import QObject, Signal

from flyreg_core.color_maps import BLUE_BROWN, VIRIDIS, ColorMap, colors_of
from flyreg_core.results import Results
from flyreg_gui.session import Session
from flyreg_gui.theme import OFF, Color

OWN, RESIDUAL, FORETOLD, LEVERAGE, WEIGHT = "own", "residual", "left out", "leverage", "weight"
CHOICES = (
    (OWN, "Their own colours", ""),
    (RESIDUAL, "Residual", "How far the moved source landmark is from the target landmark"),
    (FORETOLD, "Left-out error", "How far off all other landmarks would put it"),
    (
        LEVERAGE,
        "Leverage",
        "How far it decides its own place: at 100 % nobody else has a say there",
    ),
    (WEIGHT, "Weight", "How strongly it pulls; grey if it does not"),
)
"""Name, title and meaning."""
ROBUST = 95
"""So many per cent of the landmarks span the colours; the others have the colour of the end."""
LEAST_UM = 0.1
"""The colours span at least this much."""
LEAST_FACTOR, MOST_FACTOR = 2.0, 8.0
"""Weights span at least, and at most, so many times more and less than 1."""


@dataclass(frozen=True)
class Scaled:
    """What a bar of colours says, in the words of `views.color_scale`."""

    title: str
    unit: str  # "µm", "%", "×" for logarithms to base 2


@dataclass(frozen=True, eq=False)
class MarkerScale:
    """The colours of landmarks by id, and what they mean."""

    quantity: Scaled
    low: float
    high: float
    color_map: ColorMap
    colors: Mapping[str, Color] = field(default_factory=dict)


class MarkerColoring(QObject):
    """Holds what is chosen, and colours the landmarks of each registration by it."""

    chosen_changed = Signal(str)
    colored = Signal(object)  # Mapping of ids to colours

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.chosen = OWN
        self.scale: MarkerScale | None = None
        self._foretold: Mapping[str, float] = {}  # as last known
        self._leverage: Mapping[str, float] = {}  # as last known, per cent
        self._high = 0.0  # end of the scale when the hand last rested
        session.results_changed.connect(self._on_results)

    def choose(self, name: str) -> None:
        """Colour landmarks by something else."""
        if name != self.chosen:
            self.chosen, self._high = name, 0.0
            self._on_results(self._session.results)
            self.chosen_changed.emit(name)

    @property
    def colors(self) -> Mapping[str, Color] | None:
        """The colours by id; None where landmarks have their own."""
        return None if self.scale is None else self.scale.colors

    def _on_results(self, results: Results | None) -> None:
        if results is None:
            self._foretold, self._leverage, self._high = {}, {}, 0.0
        elif results.judgement is not None:
            self._foretold = results.judgement.leave_one_out_um
            shares = results.judgement.leverage
            self._leverage = {name: 100 * share for name, share in shares.items()}
        had_colors = self.scale is not None
        self.scale = None if results is None or self.chosen == OWN else self._scale(results)
        if had_colors or self.scale is not None:
            self.colored.emit(self.colors or {})

    def _scale(self, results: Results) -> MarkerScale | None:
        """Return the colours; the ends of the scale stay while the hand moves.

        None as long as no landmark's value is known.
        """
        acting = {mark.pair.id: mark.weight for mark in results.landmarks if mark.weight > 0}
        title = next(title for name, title, _ in CHOICES if name == self.chosen)
        if self.chosen == WEIGHT:
            values = {name: float(np.log2(weight)) for name, weight in acting.items()}
            most = max(map(abs, values.values()), default=0.0)
            high = float(np.clip(most, np.log2(LEAST_FACTOR), np.log2(MOST_FACTOR)))
            quantity, color_map = Scaled("Weight of landmarks", "×"), BLUE_BROWN
        else:
            known = {
                RESIDUAL: results.registration.residual_um,
                FORETOLD: self._foretold,
                LEVERAGE: self._leverage,
            }[self.chosen]
            values = {name: known[name] for name in acting if np.isfinite(known.get(name, np.nan))}
            high = max(float(np.percentile(list(values.values()) or [0.0], ROBUST)), LEAST_UM)
            unit = "%" if self.chosen == LEVERAGE else "µm"
            quantity, color_map = Scaled(f"{title} of landmarks", unit), VIRIDIS
        if not values:
            return None
        if results.judgement is None and self._high > 0:
            high = self._high
        self._high = high
        low = -high if self.chosen == WEIGHT else 0.0
        found = colors_of(np.array(list(values.values())), low, high, color_map).tolist()
        colors = {mark.pair.id: OFF for mark in results.landmarks}
        colors |= {name: (r, g, b) for name, (r, g, b) in zip(values, found, strict=True)}
        return MarkerScale(quantity, low, high, color_map, colors)


def is_marker_choice(name: str) -> bool:
    """Tell whether landmarks can be coloured by what is named so."""
    return name in [choice[0] for choice in CHOICES]
