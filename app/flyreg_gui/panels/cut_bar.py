"""A bar to cut all brains at corresponding places and look inside."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QCheckBox, QComboBox, QFrame, QHBoxLayout, QLabel, QSlider

STEPS = 1000


@dataclass(frozen=True)
class Cut:
    """A plane across one of the animal's axes, at a share of each brain's extent along it."""

    axis: int  # of a brain's space: left-right, dorso-ventral, antero-posterior
    share: float  # 0 at the right, ventral or posterior end
    is_turned: bool  # what lies towards 0 is taken away, not what lies towards 1


AXES = (
    ("Antero-posterior", 2, ("posterior", "anterior")),
    ("Left-right", 0, ("right", "left")),
    ("Dorso-ventral", 1, ("ventral", "dorsal")),
)


class CutBar(QFrame):
    """The axis, how far along it the cut is, and which side is taken away."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.axis = QComboBox()
        for title, number, _ in AXES:
            self.axis.addItem(title, number)
        self.axis.setAccessibleName("Axis of the cut")
        self.place = QSlider(Qt.Orientation.Horizontal)
        self.place.setRange(0, STEPS)
        self.place.setValue(STEPS // 2)
        self.place.setAccessibleName("Place of the cut")
        self.low, self.high = QLabel(), QLabel()
        self.turned = QCheckBox("Other side")
        layout = QHBoxLayout(self)
        layout.setContentsMargins(10, 3, 10, 3)
        layout.addWidget(QLabel("Cut"))
        layout.addWidget(self.axis)
        layout.addWidget(self.low)
        layout.addWidget(self.place, 1)
        layout.addWidget(self.high)
        layout.addWidget(self.turned)
        self.axis.currentIndexChanged.connect(self._on_changed)
        self.place.valueChanged.connect(self._on_changed)
        self.turned.toggled.connect(self._on_changed)
        self._on_changed()
        self.hide()

    def set_on(self, on: bool) -> None:
        """Show the bar and cut, or leave the brains whole."""
        self.setVisible(on)
        self.changed.emit()

    @property
    def cut(self) -> Cut | None:
        """The cut, if there is one."""
        if self.isHidden():
            return None
        share = self.place.value() / STEPS
        return Cut(self.axis.currentData(), share, self.turned.isChecked())

    def set_share(self, share: float) -> None:
        """Cut at another place; beyond the brain's ends is at its end."""
        self.place.setValue(round(share * STEPS))

    def _on_changed(self, *_news: object) -> None:
        _, _, ends = AXES[self.axis.currentIndex()]
        self.low.setText(ends[0])
        self.high.setText(ends[1])
        self.changed.emit()
