"""Selecting all landmarks near a place or a neuropil, to weight them together."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Signal
from PySide6.QtWidgets import (
    QComboBox,
    QDoubleSpinBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QWidget,
)

REACH_UM = 50.0
"""About as wide as an antennal lobe; suggestions lie 30 to 50 µm apart."""
SELECTED = "the selected landmark"


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
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 4)
        layout.setVerticalSpacing(2)
        layout.addWidget(QLabel("Within"), 0, 0)
        layout.addWidget(self.reach, 0, 1)
        layout.addWidget(QLabel("of"), 0, 2)
        layout.addWidget(self.place, 0, 3)
        layout.setColumnStretch(3, 1)
        self.load_button = QPushButton("Load…")
        self.load_button.setToolTip("Load surfaces of neuropils, to be named here")
        self.load_button.setAccessibleName("Load neuropils")
        self.load_button.clicked.connect(self.load_asked)
        layout.addWidget(self.load_button, 0, 4)
        row = QHBoxLayout()
        layout.addLayout(row, 1, 0, 1, 5)
        self.buttons = []
        for text, factor, tip in (
            (
                "Select these",
                1.0,
                "Select all landmarks there; the slider above weights them together",
            ),
            ("Weights × 2", 2.0, "Double the weights of all landmarks there"),
            ("Weights ÷ 2", 0.5, "Halve the weights of all landmarks there"),
        ):
            button = QPushButton(text)
            button.setToolTip(tip)
            button.setAccessibleName(tip)
            button.clicked.connect(lambda _on=False, factor=factor: self._ask(factor))
            row.addWidget(button)
            self.buttons.append(button)
        self.show_names(())

    def show_names(self, names: Sequence[str]) -> None:
        """Offer the selected landmark and these neuropils."""
        chosen = self.place.currentText()
        self.place.clear()
        self.place.addItems([SELECTED, *names])
        self.place.setCurrentText(chosen if chosen in names else SELECTED)

    def choose(self, name: str) -> None:
        """Mean one of the neuropils from now on."""
        self.place.setCurrentText(name)

    def _ask(self, factor: float) -> None:
        self.asked.emit(self.place.currentText(), self.reach.value(), factor)
