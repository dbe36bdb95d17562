"""Selecting all landmarks near a place or a neuropil, to weight them together."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QComboBox, QDoubleSpinBox, QHBoxLayout, QLabel, QPushButton, QWidget

REACH_UM = 30.0
SELECTED = "the selected landmark"
LOAD = "load neuropils…"


class NeighbourhoodBar(QWidget):
    """Within how many micrometres of what; two buttons raise or lower all weights there."""

    asked = Signal(str, float, float)  # SELECTED or a neuropil, reach in micrometres, factor
    load_asked = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.place = QComboBox()
        self.place.setAccessibleName("Near what landmarks are selected")
        self.place.setSizeAdjustPolicy(
            QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
        )
        self.place.setMinimumContentsLength(12)
        self.reach = QDoubleSpinBox()
        self.reach.setRange(1.0, 500.0)
        self.reach.setDecimals(0)
        self.reach.setValue(REACH_UM)
        self.reach.setSuffix(" µm")
        self.reach.setAccessibleName("How near, in micrometres")
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(QLabel("Within"))
        layout.addWidget(self.reach)
        layout.addWidget(QLabel("of"))
        layout.addWidget(self.place, 1)
        self.buttons = []
        for text, factor, tip in (
            ("Select", 1.0, "Select all landmarks there; the slider above weights them together"),
            ("× 2", 2.0, "Double the weights of all landmarks there"),
            ("÷ 2", 0.5, "Halve the weights of all landmarks there"),
        ):
            button = QPushButton(text)
            button.setToolTip(tip)
            button.setAccessibleName(tip)
            if factor != 1.0:
                button.setFixedWidth(button.fontMetrics().horizontalAdvance(text) + 22)
            button.clicked.connect(lambda _on=False, factor=factor: self._ask(factor))
            layout.addWidget(button)
            self.buttons.append(button)
        self.place.activated.connect(self._on_activated)
        self.show_names(())

    def show_names(self, names: Sequence[str]) -> None:
        """Offer the selected landmark, these neuropils, and to load more."""
        chosen = self.place.currentText()
        self.place.clear()
        self.place.addItems([SELECTED, *names, LOAD])
        self.place.setCurrentText(chosen if chosen in names else SELECTED)

    def _on_activated(self, _row: int) -> None:
        if self.place.currentText() == LOAD:
            self.place.setCurrentText(SELECTED)
            self.load_asked.emit()

    def _ask(self, factor: float) -> None:
        self.asked.emit(self.place.currentText(), self.reach.value(), factor)
