"""Which quantity colours the brains, and its values, found beside the window while the hand rests."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QObject, Signal

from flyreg_core.color_maps import BLUE_BROWN, VIRIDIS, ColorMap, colors_of
from flyreg_core.errors import Cancelled
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.progress import Report
from flyreg_core.project import Role
from flyreg_core.results import Results
from flyreg_core.vertex_quantities import (
    QUANTITIES,
    STATUS_NAMES,
    Quantity,
    Summary,
    quantity_named,
    summarize,
)
from flyreg_gui.session import Session
from flyreg_gui.theme import Color
from flyreg_gui.views.layers import Colors

PLAIN, ORIGINS = "plain", "origins"
"""Choices that are no quantities: the brains' own colours, and where each surface comes from."""
STATUS = "status"
"""The quantity that is of kinds: how vertices got their place, and so where folds were mended."""
UNKNOWN: Color = (150, 150, 150)
"""Where a quantity has no value, such as flattening on a trim cap."""
STATUS_COLORS: tuple[Color, ...] = (  # Okabe and Ito's palette, as `STATUS_NAMES` runs
    (86, 180, 233),
    (0, 114, 178),
    (213, 94, 0),
    (180, 180, 180),
)
STATUS_KEY = [(c, name, "") for c, name in zip(STATUS_COLORS, STATUS_NAMES, strict=True)]


@dataclass(frozen=True, eq=False)
class Judged:
    """One quantity of one registration, in colours."""

    quantity: Quantity
    registered: SurfaceMesh  # that it was found for
    surfaces: Mapping[Role, SurfaceMesh]
    colors: Mapping[Role, Colors]
    summaries: Mapping[Role, Summary]  # of the moved source, and of the target if it has values
    low: float
    high: float

    @property
    def color_map(self) -> ColorMap:
        """What the colours are taken from."""
        return BLUE_BROWN if self.quantity.is_signed else VIRIDIS

    @property
    def is_kinds(self) -> bool:
        """Tell whether the values are kinds, not amounts."""
        return self.quantity.name == STATUS


class Judging(QObject):
    """Holds what is chosen, and finds it anew for each registration that is at rest."""

    chosen_changed = Signal(str)
    changed = Signal()  # what is to be drawn
    outdated = Signal()  # what is drawn is about the registration before
    _found = Signal(object, object)  # what was asked, Judged

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.chosen = PLAIN
        self.judged: Judged | None = None
        self._asked: tuple[Results, str] | None = None
        self._is_closed = False
        self._executor = ThreadPoolExecutor(max_workers=1, thread_name_prefix="flyreg-judging")
        self._found.connect(self._on_found)
        session.results_changed.connect(self._on_results)

    def choose(self, name: str) -> None:
        """Colour the brains by a quantity, by origin, or plainly."""
        if name == self.chosen:
            return
        self.chosen, self.judged = name, None
        self._asked = None
        self.chosen_changed.emit(name)
        self.changed.emit()
        self._find()

    def show_origins(self, on: bool) -> None:
        """Colour the brains by where their surfaces come from, or no longer."""
        if on:
            self.choose(ORIGINS)
        elif self.is_by_origin:
            self.choose(PLAIN)

    @property
    def is_by_origin(self) -> bool:
        """Tell whether colours say where surfaces come from."""
        return self.chosen == ORIGINS

    @property
    def is_quantity(self) -> bool:
        """Tell whether a quantity is chosen."""
        return self.chosen not in (PLAIN, ORIGINS)

    @property
    def is_of_source_alone(self) -> bool:
        """Tell whether the colours are values of the source, and the target has none of its own."""
        return self.judged is not None and "target" not in self.judged.colors

    @property
    def is_up_to_date(self) -> bool:
        """Tell whether what is drawn is about the registration on show."""
        results, judged = self._session.results, self.judged
        return not self.is_quantity or (
            results is not None
            and judged is not None
            and judged.registered is results.registration.surface
        )

    def colors_of(self, role: Role, surface: SurfaceMesh) -> Colors | None:
        """Return the colours of a brain's vertices, if a quantity of it is known."""
        if self.judged is None or self.judged.surfaces.get(role) is not surface:
            return None
        return self.judged.colors.get(role)

    def close(self) -> None:
        """Wait for the thread; nothing is found afterwards."""
        self._is_closed, self._asked = True, None
        self._executor.shutdown(wait=True, cancel_futures=True)

    def _on_results(self, results: Results | None) -> None:
        if results is None:
            self.judged = None
        self._find()
        if not self.is_up_to_date:
            self.outdated.emit()

    def _find(self) -> None:
        """Have the values found, unless the hand still moves: then the old colours stay."""
        results = self._session.results
        if not self.is_quantity or results is None or self._is_closed:
            return
        if results.distances is None or self.is_up_to_date:
            return
        asked = (results, self.chosen)
        if self._asked is None or self._asked[0] is not results or self._asked[1] != self.chosen:
            self._asked = asked
            self._executor.submit(self._run, asked)

    def _run(self, asked: tuple[Results, str]) -> None:  # worker thread from here on
        def report(_fraction: float, _text: str) -> None:
            if asked is not self._asked:
                raise Cancelled

        try:
            report(0.0, "")
            judged = judge_by(quantity_named(asked[1]), asked[0], report)
        except Cancelled:
            return
        self._found.emit(asked, judged)

    def _on_found(self, asked: tuple[Results, str], judged: Judged) -> None:
        if asked is self._asked:
            self.judged = judged
            self.changed.emit()


def is_choice(name: str) -> bool:
    """Tell whether brains can be coloured by what is named so."""
    return name in (PLAIN, ORIGINS, *(quantity.name for quantity in QUANTITIES))


def judge_by(quantity: Quantity, results: Results, report: Report) -> Judged:
    """Return a quantity of a registration in colours."""
    values = quantity.compute(results, report)
    moved, target = results.registration.surface, results.target.surface
    surfaces: dict[Role, SurfaceMesh] = {"source": results.source.surface, "target": target}
    found: dict[Role, Floats | None] = {"source": values.source, "target": values.target}
    known = {role: own for role, own in found.items() if own is not None}
    areas = {"source": moved.vertex_areas, "target": target.vertex_areas}
    high = max(summarize(own, areas[role], quantity).high for role, own in known.items())
    summaries = {
        role: summarize(own, areas[role], quantity, within=high) for role, own in known.items()
    }
    low = -high if quantity.is_signed else 0.0
    if quantity.name == STATUS:
        palette = np.array(STATUS_COLORS, dtype=np.uint8)
        colors = {role: palette[own.astype(int)] for role, own in known.items()}
        return Judged(quantity, moved, surfaces, colors, summaries, 0.0, len(STATUS_NAMES) - 1.0)
    color_map = BLUE_BROWN if quantity.is_signed else VIRIDIS
    colors = {role: _colored(own, low, high, color_map) for role, own in known.items()}
    return Judged(quantity, moved, surfaces, colors, summaries, low, high)


def _colored(values: Floats, low: float, high: float, color_map: ColorMap) -> Colors:
    colors = colors_of(np.nan_to_num(values), low, high, color_map)
    colors[~np.isfinite(values)] = UNKNOWN
    return colors


def text_of(value: float, unit: str) -> str:
    """Return a value as people read it: log2 of a factor as the factor."""
    if unit == "×":
        factor = 2.0**value
        return f"×{factor:.2f}" if factor < 10 else f"×{factor:,.0f}"
    digits = 0 if abs(value) >= 100 else 1 if abs(value) >= 10 else 2
    return f"{value:.{digits}f}{unit}" if unit == "°" else f"{value:.{digits}f} {unit}".strip()
