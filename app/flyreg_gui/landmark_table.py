"""The landmarks as a table: the model, and a view whose weight column is a row of sliders."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Any

import numpy as np
from PySide6.QtCore import (
    QAbstractTableModel,
    QModelIndex,
    QObject,
    QPersistentModelIndex,
    Qt,
    Signal,
)
from PySide6.QtGui import QColor, QFont

from flyreg_core.landmarks import LandmarkPair
from flyreg_core.project import Project
from flyreg_core.results import Results
from flyreg_gui.theme import KIND_COLORS, OFF, Color, current_theme

Index = QModelIndex | QPersistentModelIndex
ROOT = QModelIndex()
SORT_ROLE = Qt.ItemDataRole.UserRole
ID_ROLE = Qt.ItemDataRole.UserRole + 1
OUTLYING = 5.0
"""A leave-one-out error so many times as far from the median as is usual stands out."""
LEAST_SUSPICIOUS_UM = 5.0
"""An error below this never stands out: a fly's brain is some 300 um wide."""
LONGEST_NUMBER = 20
"""Digits of the longest number in a name that is sorted by its value."""


class Column(IntEnum):
    """The columns, in their order on the screen."""

    NAME = 0
    PLACE = 1
    WEIGHT = 2
    RESIDUAL = 3
    FORETOLD = 4
    LEVERAGE = 5


HEADERS = ("Landmark", "Curve", "Weight", "Residual\nµm", "Left out\nµm", "Leverage\n%")
HEADER_TIPS = (
    "Untick a landmark to see what happens without it; double-click one of your own to rename it",
    "The curve a landmark lies on, and the half if it belongs to one only",
    "How strongly a pair pulls: drag, or double-click the number; 0 leaves it out",
    "How far the moved source landmark is from the target landmark, in micrometres",
    "How far off all other landmarks would put it, in micrometres: a wrong click stands out",
    "How far a landmark decides its own place: 0 % not at all, 100 % nobody else has a say there",
)
LATE = "Before this change; measured anew when the hand rests"
NUMBERS = (Column.RESIDUAL, Column.FORETOLD, Column.LEVERAGE)


@dataclass(frozen=True)
class Judged:
    """What results tell about the landmarks, by id."""

    residual_um: Mapping[str, float] = field(default_factory=dict)
    foretold_um: Mapping[str, float] = field(default_factory=dict)
    leverage: Mapping[str, float] = field(default_factory=dict)
    suspicious: frozenset[str] = frozenset()
    is_late: bool = False  # what is known only at rest is that of results before

    @classmethod
    def of(cls, results: Results | None, before: Judged) -> Judged:
        """Return what is known; until the hand rests, some of it is what was known before."""
        if results is None:
            return cls()
        residual, judgement = results.registration.residual_um, results.judgement
        if judgement is None:
            return replace(before, residual_um=residual, is_late=True)
        foretold = judgement.leave_one_out_um
        return cls(residual, foretold, judgement.leverage, outlying(foretold))

    def number(self, column: Column, identifier: str) -> float | None:
        """Return what one of the columns of numbers holds; None where it is not known."""
        values = {
            Column.RESIDUAL: self.residual_um,
            Column.FORETOLD: self.foretold_um,
            Column.LEVERAGE: self.leverage,
        }
        return values[column].get(identifier)


def outlying(errors: Mapping[str, float]) -> frozenset[str]:
    """Return the ids of errors far from the median, in terms of the median distance from it."""
    values = np.array(list(errors.values()))
    if not len(values):
        return frozenset()
    median = float(np.median(values))
    spread = float(np.median(np.abs(values - median)))
    limit = max(median + OUTLYING * spread, LEAST_SUSPICIOUS_UM)
    return frozenset(name for name, error in errors.items() if error > limit)


@dataclass(frozen=True)
class Row:
    """One landmark pair, with the weight that the project gives it now."""

    pair: LandmarkPair
    is_muted: bool = False

    @property
    def place(self) -> str:
        """The curve, and the half if the pair belongs to one only."""
        half = f" of the {self.pair.half} half" if self.pair.half else ""
        by = ", suggested by shape" if self.pair.origin == "suggested" else ""
        return f"{self.pair.kind}{half}{by}"

    @property
    def lacking(self) -> str:
        """On which brain the pair is still to be placed; empty if on none."""
        lacks = [role for role in ("source", "target") if getattr(self.pair, role) is None]
        return " and ".join(lacks)

    @property
    def is_acting(self) -> bool:
        """Tell whether the pair pulls."""
        return not self.is_muted and not self.lacking and self.pair.weight > 0


class LandmarkTable(QAbstractTableModel):
    """The landmarks of the newest project, with what is known of them from the results."""

    ticked = Signal(str, bool)  # id, whether it is to pull

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._rows: list[Row] = []
        self._told = _told(None, None)  # what the rows follow from
        self._judged = Judged()
        self._judged_of: object = None
        self._italic = QFont()
        self._italic.setItalic(True)
        self._by_id: dict[str, LandmarkPair] = {}
        self._colors: Mapping[str, Color] = {}

    def show(self, project: Project | None, results: Results | None) -> None:
        """Show the landmarks of a project; `results` may be those of an earlier one."""
        before, told = self._rows, _told(project, results)
        is_known = all(a is b for a, b in zip(told, self._told, strict=True))
        rows, self._told = before if is_known else _rows(project, results), told
        by_id = {row.pair.id: row.pair for row in rows}
        is_new = list(self._by_id) != list(by_id)
        is_judged_anew, was_late = results is not self._judged_of, self._judged.is_late
        if is_judged_anew:
            self._judged, self._judged_of = Judged.of(results, self._judged), results
        if is_new:
            self.beginResetModel()
        self._rows, self._by_id = rows, by_id
        if is_new:
            self.endResetModel()
            return
        changed = [
            number
            for number, (old, new) in enumerate(zip(before, rows, strict=True))
            if (old.pair is not new.pair and old != new) or old.is_muted != new.is_muted
        ]
        if changed:
            last = self.index(changed[-1], len(Column) - 1)
            self.dataChanged.emit(self.index(changed[0], 0), last)
        if is_judged_anew and rows:
            stays_late = was_late and self._judged.is_late
            last_column = Column.RESIDUAL if stays_late else Column.LEVERAGE
            last = self.index(len(rows) - 1, last_column)
            self.dataChanged.emit(self.index(0, Column.RESIDUAL), last)

    def show_colors(self, colors: Mapping[str, Color]) -> None:
        """Show landmarks in other colours than their own, by id."""
        self._colors = colors
        if self._rows:
            last = self.index(len(self._rows) - 1, Column.NAME)
            self.dataChanged.emit(self.index(0, Column.NAME), last)

    def pair(self, row: int) -> LandmarkPair:
        """Return the pair in a row."""
        return self._rows[row].pair

    def pair_of(self, identifier: str) -> LandmarkPair | None:
        """Return the pair with an id."""
        return self._by_id.get(identifier)

    @property
    def ids(self) -> list[str]:
        """The ids of all pairs, row by row."""
        return list(self._by_id)

    # What Qt asks

    def rowCount(self, parent: Index = ROOT) -> int:
        """Return how many landmarks there are."""
        return 0 if parent.isValid() else len(self._rows)

    def columnCount(self, parent: Index = ROOT) -> int:
        """Return how many columns there are."""
        return 0 if parent.isValid() else len(Column)

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        """Return the headers and their tips."""
        if orientation == Qt.Orientation.Horizontal:
            if role == Qt.ItemDataRole.DisplayRole:
                return HEADERS[section]
            if role == Qt.ItemDataRole.ToolTipRole:
                return HEADER_TIPS[section]
        return None

    def flags(self, index: Index) -> Qt.ItemFlag:
        """Return what can be done with a cell: weights and one's own names are edited."""
        flags = Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable
        if not index.isValid():
            return Qt.ItemFlag.NoItemFlags
        is_name = index.column() == Column.NAME
        if is_name:
            flags |= Qt.ItemFlag.ItemIsUserCheckable
        is_own = is_name and self.pair(index.row()).origin == "user"
        if is_own or index.column() == Column.WEIGHT:
            flags |= Qt.ItemFlag.ItemIsEditable
        return flags

    def setData(self, index: Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:
        """Tell of a tick instead of keeping it; it is shown when the project has it."""
        if role != Qt.ItemDataRole.CheckStateRole or not index.isValid():
            return False
        is_on = Qt.CheckState(value) == Qt.CheckState.Checked
        self.ticked.emit(self.pair(index.row()).id, is_on)
        return True

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """Return what is shown in a cell, or known about its row."""
        if not index.isValid():
            return None
        row, column = self._rows[index.row()], Column(index.column())
        match role:
            case Qt.ItemDataRole.DisplayRole:
                return self._text(row, column)
            case Qt.ItemDataRole.EditRole:
                return row.pair.weight if column == Column.WEIGHT else row.pair.name
            case Qt.ItemDataRole.CheckStateRole if column == Column.NAME:
                return Qt.CheckState.Unchecked if row.is_muted else Qt.CheckState.Checked
            case Qt.ItemDataRole.DecorationRole if column == Column.NAME:
                own = color_of(row.pair, row.is_acting)
                return QColor(*self._colors.get(row.pair.id, own))
            case Qt.ItemDataRole.ForegroundRole:
                return self._ink(row, column)
            case Qt.ItemDataRole.FontRole if self._is_late(column) or (
                column == Column.NAME and row.pair.origin == "suggested"
            ):
                return self._italic
            case Qt.ItemDataRole.ToolTipRole:
                return self._tip(row, column)
            case Qt.ItemDataRole.TextAlignmentRole if column in NUMBERS:
                return Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
            case _ if role == SORT_ROLE:
                return self._sort_key(row, column)
            case _ if role == ID_ROLE:
                return row.pair.id
        return None

    def _text(self, row: Row, column: Column) -> str:
        match column:
            case Column.NAME:
                return row.pair.short_name  # italics say that it is only suggested
            case Column.PLACE:
                return f"place on {row.lacking}" if row.lacking else row.pair.kind
            case Column.WEIGHT:
                return format_weight(row.pair.weight)
            case Column.RESIDUAL if row.lacking:
                return "half" if " and " not in row.lacking else "to place"  # the column is narrow
        number = self._judged.number(column, row.pair.id)
        if number is None:
            return ""
        if column == Column.LEVERAGE:
            return f"{100 * number:.0f}"
        mark = "⚠ " if column == Column.FORETOLD and row.pair.id in self._judged.suspicious else ""
        if not np.isfinite(number):
            return "alone"
        return f"{mark}{number:.2f}" if number < 100 else f"{mark}{number:.0f}"

    def _is_late(self, column: Column) -> bool:
        """Tell whether a column holds what was known before the change that is being made."""
        return self._judged.is_late and column in (Column.FORETOLD, Column.LEVERAGE)

    def _sort_key(self, row: Row, column: Column) -> Any:
        match column:
            case Column.NAME:
                return naturally(row.pair.name)
            case Column.PLACE:
                return naturally(f"{row.place} {row.pair.name}")
            case Column.WEIGHT:
                return row.pair.weight
        number = self._judged.number(column, row.pair.id)
        return -1.0 if number is None else number

    def _ink(self, row: Row, column: Column) -> QColor | None:
        if self._is_late(column):
            return QColor(*current_theme().faint)
        if row.lacking or (column == Column.FORETOLD and row.pair.id in self._judged.suspicious):
            return QColor(*current_theme().bad)
        return None if row.is_acting else QColor(*current_theme().faint)

    def _tip(self, row: Row, column: Column) -> str:
        if self._is_late(column):
            return LATE
        if row.lacking:
            return (
                f"{row.pair.name}: not placed on the {row.lacking} yet; select it and click its "
                "place in landmark mode"
            )
        if column == Column.FORETOLD and row.pair.id in self._judged.suspicious:
            return (
                f"{row.pair.name}: the other landmarks would put it "
                f"{self._judged.foretold_um[row.pair.id]:.1f} µm away, far more than is usual here; "
                "see whether both ends are at the same place of the brain"
            )
        return _tip(row)


def _told(project: Project | None, results: Results | None) -> tuple[object, ...]:
    """Return all that rows follow from; while lambda is dragged it stays the same."""
    made = None if results is None else results.landmarks
    if project is None:
        return None, None, None, None, made
    return project.pairs, project.weights, project.muted, project.solo, made


def _rows(project: Project | None, results: Results | None) -> list[Row]:
    """Return all pairs, with the weights that the project gives them now."""
    if project is None:
        return []
    made = [mark.pair for mark in results.landmarks] if results is not None else []
    pairs = []
    for pair in made:
        if pair.origin != "user":
            usual = 1.0 if pair.origin == "boundary" else pair.weight
            weight = project.weights.get(pair.id, usual)
            pairs.append(pair if pair.weight == weight else replace(pair, weight=weight))
    return [Row(pair, project.is_muted(pair.id)) for pair in (*pairs, *project.pairs)]


def color_of(pair: LandmarkPair, is_acting: bool) -> tuple[int, int, int]:
    """Return the colour of a landmark: its own, that of its kind, or grey where it does not pull."""
    if not is_acting:
        return OFF
    return pair.color or KIND_COLORS[pair.kind]


def _tip(row: Row) -> str:
    weight = row.pair.weight
    if weight == 0:
        return f"{row.pair.name} ({row.place}): weight 0, left out of the spline"
    inverse = f"W⁻¹ entry {1 / weight:.4g}"
    muted = "; muted, so it does not pull" if row.is_muted else ""
    return f"{row.pair.name} ({row.place}): weight {format_weight(weight)}, {inverse}{muted}"


def naturally(name: str) -> str:
    """Return a name as it is sorted: by the numbers in it, "upper 2" before "upper 10"."""
    return re.sub(r"\d+", lambda digits: digits[0].zfill(LONGEST_NUMBER), name.casefold())


def format_weight(weight: float) -> str:
    """Return a weight as the user reads it; 0 is "off"."""
    if weight <= 0:
        return "off"
    return f"{weight:.2g}" if weight < 0.1 else f"{weight:.3g}"
