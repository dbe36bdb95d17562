"""The landmarks as a table: the model, and a view whose weight column is a row of sliders."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

from PySide6.QtCore import QAbstractTableModel, QModelIndex, QObject, QPersistentModelIndex, Qt
from PySide6.QtGui import QColor

from flyreg_core.landmarks import LandmarkPair
from flyreg_core.project import Project
from flyreg_core.results import Results
from flyreg_gui.theme import KIND_COLORS, OFF

Index = QModelIndex | QPersistentModelIndex
ROOT = QModelIndex()
SORT_ROLE = Qt.ItemDataRole.UserRole
ID_ROLE = Qt.ItemDataRole.UserRole + 1


class Column(IntEnum):
    """The columns, in their order on the screen."""

    NAME = 0
    PLACE = 1
    WEIGHT = 2
    RESIDUAL = 3


HEADERS = ("Landmark", "Curve", "Weight", "Resid.")
HEADER_TIPS = (
    "Double-click a landmark of your own to rename it",
    "The curve a landmark lies on, and the half if it belongs to one only",
    "How strongly a pair pulls: drag, or double-click the number; 0 leaves it out",
    "How far the moved source landmark is from the target landmark, in micrometres",
)


@dataclass(frozen=True)
class Row:
    """One landmark pair, with the weight that the project gives it now."""

    pair: LandmarkPair
    residual_um: float | None  # None: not known yet

    @property
    def place(self) -> str:
        """The curve, and the half if the pair belongs to one only."""
        half = f" of the {self.pair.half} half" if self.pair.half else ""
        by = ", suggested by shape" if self.pair.origin == "suggested" else ""
        return f"{self.pair.kind}{half}{by}"


class LandmarkTable(QAbstractTableModel):
    """The landmarks of the newest project, with what is known of them from the results."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._pairs: list[LandmarkPair] = []
        self._residuals: Mapping[str, float] = {}
        self._by_id: dict[str, LandmarkPair] = {}

    def show(self, project: Project | None, results: Results | None) -> None:
        """Show the landmarks of a project; `results` may be those of an earlier one."""
        before, pairs = self._pairs, _pairs(project, results)
        known, residuals = self._residuals, _residuals(results)
        by_id = {pair.id: pair for pair in pairs}
        is_new = list(self._by_id) != list(by_id)
        if is_new:
            self.beginResetModel()
        self._pairs, self._residuals, self._by_id = pairs, residuals, by_id
        if is_new:
            self.endResetModel()
            return
        changed = [
            row
            for row, (old, new) in enumerate(zip(before, self._pairs, strict=True))
            if old is not new and old != new
        ]
        if changed:
            last = self.index(changed[-1], len(Column) - 1)
            self.dataChanged.emit(self.index(changed[0], 0), last)
        if known is not self._residuals and self._pairs:
            last = self.index(len(self._pairs) - 1, Column.RESIDUAL)
            self.dataChanged.emit(self.index(0, Column.RESIDUAL), last)

    def pair(self, row: int) -> LandmarkPair:
        """Return the pair in a row."""
        return self._pairs[row]

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
        return 0 if parent.isValid() else len(self._pairs)

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
        own_name = index.column() == Column.NAME and self.pair(index.row()).origin == "user"
        if own_name or index.column() == Column.WEIGHT:
            flags |= Qt.ItemFlag.ItemIsEditable
        return flags

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """Return what is shown in a cell, or known about its row."""
        if not index.isValid():
            return None
        pair = self._pairs[index.row()]
        row, column = Row(pair, self._residuals.get(pair.id)), Column(index.column())
        match role:
            case Qt.ItemDataRole.DisplayRole:
                return _text(row, column)
            case Qt.ItemDataRole.EditRole:
                return row.pair.weight if column == Column.WEIGHT else row.pair.name
            case Qt.ItemDataRole.DecorationRole if column == Column.PLACE:
                return QColor(*(KIND_COLORS[row.pair.kind] if row.pair.weight > 0 else OFF))
            case Qt.ItemDataRole.ToolTipRole:
                return _tip(row)
            case Qt.ItemDataRole.TextAlignmentRole if column == Column.RESIDUAL:
                return Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
            case _ if role == SORT_ROLE:
                return _sort_key(row, column)
            case _ if role == ID_ROLE:
                return row.pair.id
        return None


def _pairs(project: Project | None, results: Results | None) -> list[LandmarkPair]:
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
    return [*pairs, *project.pairs]


def _residuals(results: Results | None) -> Mapping[str, float]:
    return results.registration.residual_um if results is not None else {}


def _text(row: Row, column: Column) -> str:
    match column:
        case Column.NAME:
            return row.pair.name
        case Column.PLACE:
            return row.pair.kind
        case Column.WEIGHT:
            return format_weight(row.pair.weight)
        case Column.RESIDUAL:
            return "" if row.residual_um is None else f"{row.residual_um:.2f}"


def _sort_key(row: Row, column: Column) -> Any:
    match column:
        case Column.NAME:
            return row.pair.name
        case Column.PLACE:
            return row.place
        case Column.WEIGHT:
            return row.pair.weight
        case Column.RESIDUAL:
            return -1.0 if row.residual_um is None else row.residual_um


def _tip(row: Row) -> str:
    weight = row.pair.weight
    if weight == 0:
        return f"{row.pair.name} ({row.place}): weight 0, left out of the spline"
    inverse = f"W⁻¹ entry {1 / weight:.4g}"
    return f"{row.pair.name} ({row.place}): weight {format_weight(weight)}, {inverse}"


def format_weight(weight: float) -> str:
    """Return a weight as the user reads it; 0 is "off"."""
    return f"{weight:.3g}" if weight > 0 else "off"
