"""Sliders over several powers of ten."""

from __future__ import annotations

import math
from dataclasses import dataclass

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QSlider, QStyle, QStyleOptionSlider

DIGITS = 3
"""Significant digits of a value that a slider gives."""


@dataclass(frozen=True)
class LogScale:
    """Positions 1 to `steps` for `low` to `high`; position 0 for 0 if the scale has one."""

    low: float
    high: float
    steps: int
    has_zero: bool = False

    def value(self, position: int) -> float:
        """Return the value at a position."""
        if self.has_zero and position <= 0:
            return 0.0
        share = (max(position, 1) - 1) / (self.steps - 1)
        exact = self.low * (self.high / self.low) ** share
        return float(f"{exact:.{DIGITS}g}")

    def position(self, value: float) -> int:
        """Return the position nearest to a value."""
        if value <= 0:
            return 0 if self.has_zero else 1
        share = math.log(value / self.low) / math.log(self.high / self.low)
        return min(max(round(1 + share * (self.steps - 1)), 1), self.steps)

    def share(self, value: float) -> float:
        """Return how far along the slider a value lies, 0 to 1."""
        first = 0 if self.has_zero else 1
        return (self.position(value) - first) / (self.steps - first)

    def value_at(self, share: float) -> float:
        """Return the value at a share of the way along the slider."""
        first = 0 if self.has_zero else 1
        return self.value(round(first + min(max(share, 0.0), 1.0) * (self.steps - first)))


WEIGHT_SCALE = LogScale(0.01, 100.0, 401, has_zero=True)
SMOOTHING_SCALE = LogScale(1e-6, 100.0, 401)


class LogSlider(QSlider):
    """A slider that jumps to where it is pressed and follows the mouse from there.

    `edited` tells values that the user chose; what the program shows is silent.
    """

    edited = Signal(float)

    def __init__(self, scale: LogScale) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        self.scale = scale
        self.setRange(0 if scale.has_zero else 1, scale.steps)
        self.setPageStep(max(scale.steps // 20, 1))
        self.valueChanged.connect(self._on_value_changed)

    def show_value(self, value: float) -> None:
        """Stand at a value without telling anybody."""
        with QSignalBlocker(self):
            self.setValue(self.scale.position(value))

    def _on_value_changed(self, position: int) -> None:
        self.edited.emit(self.scale.value(position))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Jump to the mouse and follow it."""
        if event.button() != Qt.MouseButton.LeftButton:
            event.ignore()
            return
        self.setSliderDown(True)
        self._follow(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Follow the mouse."""
        if self.isSliderDown():
            self._follow(event)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Stay where the mouse let go."""
        if event.button() == Qt.MouseButton.LeftButton:
            self.setSliderDown(False)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Leave the wheel to what scrolls: scrolling past must change nothing."""
        event.ignore()

    def _follow(self, event: QMouseEvent) -> None:
        option = QStyleOptionSlider()
        self.initStyleOption(option)
        handle = self.style().pixelMetric(QStyle.PixelMetric.PM_SliderLength, option, self)
        position = round(event.position().x() - handle / 2)
        span = self.width() - handle
        self.setValue(
            QStyle.sliderValueFromPosition(self.minimum(), self.maximum(), position, span)
        )
