"""The two buttons of a dock in the colours of the theme; the style's own are dark on dark ground."""

from __future__ import annotations

from PySide6.QtCore import QLineF, QRectF, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPen, QPixmap
from PySide6.QtWidgets import QAbstractButton, QDockWidget

from flyreg_gui.theme import Color, Theme

SIZE = 32
"""Pixels of an icon, more than any screen shows."""
WIDTH, NEAR, FAR = 3.0, 8.0, 24.0


def show_dock_icons(dock: QDockWidget, theme: Theme) -> None:
    """Draw how a dock is closed, and how it is taken out of the window or put back."""
    for name, icon in (
        ("qt_dockwidget_closebutton", _cross(theme.text)),
        ("qt_dockwidget_floatbutton", _windows(theme.text)),
    ):
        button = dock.findChild(QAbstractButton, name)
        if isinstance(button, QAbstractButton):
            button.setIcon(icon)


def _cross(color: Color) -> QIcon:
    pixmap, painter = _canvas(color)
    painter.drawLines([QLineF(NEAR, NEAR, FAR, FAR), QLineF(NEAR, FAR, FAR, NEAR)])
    painter.end()
    return QIcon(pixmap)


def _windows(color: Color) -> QIcon:
    pixmap, painter = _canvas(color)
    step = (FAR - NEAR) / 3
    painter.drawRect(QRectF(NEAR, NEAR + step, FAR - NEAR - step, FAR - NEAR - step))
    behind = QLineF(NEAR + step, NEAR, FAR, NEAR), QLineF(FAR, NEAR, FAR, FAR - step)
    painter.drawLines(behind)
    painter.end()
    return QIcon(pixmap)


def _canvas(color: Color) -> tuple[QPixmap, QPainter]:
    """Return an empty picture, and what draws on it in a colour."""
    pixmap = QPixmap(SIZE, SIZE)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(QColor(*color), WIDTH))
    return pixmap, painter
