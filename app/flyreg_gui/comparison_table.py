"""The table of methods: ticked before, filled while they are compared."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableWidget, QTableWidgetItem

from flyreg_core.comparison import FLYREG, METHODS, OWN, TITLES
from flyreg_core.report_page import looked_up
from flyreg_core.rivals.table import RIVAL_OF
from flyreg_gui.theme import current_theme

COLUMNS: tuple[tuple[str, str, float, int, str], ...] = (
    ("Mean", "source_to_target.mean_um", 1, 3, "Mean distance to the target, µm"),
    ("RMS", "source_to_target.rms_um", 1, 3, "Root mean square distance to the target, µm"),
    ("Mean back", "target_to_source.mean_um", 1, 3, "Mean distance of the target from it, µm"),
    ("RMS back", "target_to_source.rms_um", 1, 3, "The same, root mean square, µm"),
    ("TRE", "tre_mean_um", 1, 2, "Target registration error on the points, mean, µm"),
    ("TRE 95 %", "tre_p95_um", 1, 2, "95th percentile of the target registration error, µm"),
    ("Folded %", "folded_share", 100, 3, "Share of the source's area that was folded over"),
    ("Time, s", "seconds", 1, 1, "Time, seconds; of flyreg from the files on"),
    ("Memory, MB", "peak_memory_mb", 1, 0, "Most memory of its process, megabytes"),
)
"""Header, key in the facts of a row, factor, digits, and tip."""
PADDING = 6
"""Of a row, pixels."""
CHECKED, UNCHECKED = Qt.CheckState.Checked, Qt.CheckState.Unchecked


class ComparisonTable(QTableWidget):
    """One row for each method; what it could not do stands where its figures would."""

    def __init__(self) -> None:
        super().__init__(len(METHODS), 1 + len(COLUMNS))
        self.setAccessibleName("Methods")
        self.setHorizontalHeaderItem(0, QTableWidgetItem("Method"))
        for number, column in enumerate(COLUMNS, 1):
            title = QTableWidgetItem(column[0])
            title.setToolTip(column[4])
            self.setHorizontalHeaderItem(number, title)
        self.verticalHeader().hide()
        self.verticalHeader().setDefaultSectionSize(self.fontMetrics().height() + PADDING)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._lacking = {name: "" if name == FLYREG else RIVAL_OF[name].lacking for name in METHODS}
        self.boxes = {name: QTableWidgetItem(TITLES[name]) for name in METHODS}
        for row, (name, item) in enumerate(self.boxes.items()):
            item.setToolTip(OWN if name == FLYREG else RIVAL_OF[name].description)
            item.setCheckState(UNCHECKED if self._lacking[name] else CHECKED)
            self.setItem(row, 0, item)
        header = self.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.ResizeToContents)
        self.clear_rows()
        self.set_ticking(True)
        self.show_errors(False)

    @property
    def ticked(self) -> tuple[str, ...]:
        """The methods that are ticked."""
        return tuple(name for name, box in self.boxes.items() if box.checkState() == CHECKED)

    def set_ticking(self, on: bool) -> None:
        """Let methods be ticked, or not while they are compared."""
        for name, box in self.boxes.items():
            flags = Qt.ItemFlag.NoItemFlags
            if not self._lacking[name]:
                flags = Qt.ItemFlag.ItemIsEnabled
                if on:
                    flags |= Qt.ItemFlag.ItemIsUserCheckable
            box.setFlags(flags)

    def show_errors(self, on: bool) -> None:
        """Show the columns of the target registration error, which is measured only on points."""
        for number, (_, key, *_) in enumerate(COLUMNS, 1):
            if key.startswith("tre"):
                self.setColumnHidden(number, not on)

    def clear_rows(self) -> None:
        """Take all figures away."""
        for name in METHODS:
            self.describe(name)

    def describe(self, name: str) -> None:
        """Say what a method is, or why it cannot be run here."""
        self.say(name, self._lacking[name] or self.boxes[name].toolTip())

    def say(self, name: str, sentence: str) -> None:
        """Put a sentence where the figures of a method would stand."""
        row = METHODS.index(name)
        for column in range(1, self.columnCount()):
            self.takeItem(row, column)
        self.setSpan(row, 1, 1, len(COLUMNS))
        item = QTableWidgetItem(sentence)
        item.setForeground(QColor(*current_theme().faint))
        item.setToolTip(sentence)
        self.setItem(row, 1, item)

    def show_row(self, facts: Mapping[str, Any]) -> None:
        """Show what a method came to, as JSON has it."""
        name = facts["method"]
        if facts["status"] != "done":
            self.say(name, facts["status"])
            return
        row = METHODS.index(name)
        self.setSpan(row, 1, 1, 1)
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        for number, (_, key, factor, digits, _) in enumerate(COLUMNS, 1):
            value = looked_up(facts, key)
            item = QTableWidgetItem("-" if value is None else f"{factor * value:.{digits}f}")
            item.setTextAlignment(right)
            item.setToolTip("no points were given" if value is None else f"{factor * value!r}")
            self.setItem(row, number, item)
        self.scrollToItem(self.boxes[name])

    def text(self, name: str, header: str) -> str:
        """Return what stands in a cell."""
        headers = [column[0] for column in COLUMNS]
        item = self.item(METHODS.index(name), 1 + headers.index(header))
        return "" if item is None else item.text()
