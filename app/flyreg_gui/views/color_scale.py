"""The legend of a quantity: a bar of its colours with numbers, over a corner of a view."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from PySide6.QtCore import QRect, QSize, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from flyreg_core.color_maps import ColorMap
from flyreg_gui.judging import text_of
from flyreg_gui.theme import Theme

BAR_WIDTH, BAR_HEIGHT = 130, 9
PADDING = 6
ROOM = 10_000
TICKS = 3
FEWEST_TICKS = 2
BETWEEN = 10
"""Pixels between two numbers."""
TITLE_FLAGS = Qt.AlignmentFlag.AlignLeft | Qt.TextFlag.TextWordWrap
SIDES = (Qt.AlignmentFlag.AlignLeft, Qt.AlignmentFlag.AlignHCenter, Qt.AlignmentFlag.AlignRight)


class Named(Protocol):
    """What a scale is about."""

    @property
    def title(self) -> str:
        """Its name."""

    @property
    def unit(self) -> str:
        """See `judging.text_of`."""


class Scale(Protocol):
    """A quantity and its range in colours."""

    @property
    def quantity(self) -> Named:
        """What it is about."""

    @property
    def low(self) -> float:
        """The value at the left end."""

    @property
    def high(self) -> float:
        """The value at the right end."""

    @property
    def color_map(self) -> ColorMap:
        """The colours from left to right."""


class ColorScale(QWidget):
    """A bar with the ends of its range and the middle, and what it is about."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.judged: Scale | None = None
        self._theme: Theme | None = None
        self._room = ROOM
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.hide()

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        self._theme = theme
        self.update()

    def show_judged(self, judged: Scale | None) -> None:
        """Show the scale of a quantity, or nothing."""
        self.judged = judged
        self.setVisible(judged is not None)
        if judged is not None:
            self.setAccessibleName(f"{judged.quantity.title}: {', '.join(self.texts)}")
            self.fit_into(self._room)

    def fit_into(self, width: int) -> None:
        """Take no more than so many pixels: the title has more lines, the middle number is left out."""
        self._room = width
        self.resize(self.sizeHint())
        self.update()

    @property
    def texts(self) -> list[str]:
        """The numbers at the bar, as many as there is room for."""
        texts = self._texts(TICKS)
        wide = sum(self.fontMetrics().horizontalAdvance(text) + BETWEEN for text in texts)
        return texts if wide <= self._room - 2 * PADDING else self._texts(FEWEST_TICKS)

    def _texts(self, count: int) -> list[str]:
        judged = self.judged
        if judged is None:
            return []
        values = np.linspace(judged.low, judged.high, count)
        return [text_of(float(value), judged.quantity.unit) for value in values]

    def sizeHint(self) -> QSize:
        """Return room for the title, the bar and its numbers."""
        metrics = self.fontMetrics()
        title = metrics.horizontalAdvance(self._title)
        numbers = sum(metrics.horizontalAdvance(text) + BETWEEN for text in self.texts)
        width = min(max(BAR_WIDTH, title, numbers) + 2 * PADDING, self._room)
        lines = self._title_height(width - 2 * PADDING) + metrics.height()
        return QSize(width, lines + BAR_HEIGHT + 2 * PADDING + 4)

    @property
    def _title(self) -> str:
        return self.judged.quantity.title if self.judged is not None else ""

    def _title_height(self, width: int) -> int:
        """Return how many pixels the title takes, in as many lines as it needs."""
        room = QRect(0, 0, width, ROOM)
        return self.fontMetrics().boundingRect(room, TITLE_FLAGS, self._title).height()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Draw title, bar and numbers."""
        judged, theme = self.judged, self._theme
        if judged is None or theme is None:
            return
        with QPainter(self) as painter:
            ground = QColor(*theme.background)
            ground.setAlpha(225)
            painter.setPen(QColor(*theme.faint))
            painter.setBrush(ground)
            painter.drawRect(self.rect().adjusted(0, 0, -1, -1))
            painter.setPen(QColor(*theme.text))
            line, inner = self.fontMetrics().height(), self.width() - 2 * PADDING
            high = self._title_height(inner)
            painter.drawText(QRect(PADDING, PADDING, inner, high), TITLE_FLAGS, self._title)
            bar = QRect(PADDING, PADDING + high + 2, inner, BAR_HEIGHT)
            painter.drawImage(bar, bar_image(judged))
            below = QRect(PADDING, bar.bottom() + 3, inner, line)
            sides = (*SIDES[: len(self.texts) - 1], SIDES[-1])
            for text, side in zip(self.texts, sides, strict=True):
                painter.drawText(below, side, text)


def bar_image(judged: Scale, width: int = 256) -> QImage:
    """Return a row of pixels with the colours of a quantity's range."""
    colors = np.ascontiguousarray(judged.color_map(np.linspace(0, 1, width)))
    return QImage(colors.tobytes(), width, 1, 3 * width, QImage.Format.Format_RGB888).copy()
