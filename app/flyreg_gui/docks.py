"""What stands around the views: steps, landmarks, the history of changes, and what judges."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QUndoStack
from PySide6.QtWidgets import QDockWidget, QUndoView

from flyreg_gui.dock_icons import show_dock_icons
from flyreg_gui.theme import current_theme

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow

LEFT, RIGHT = Qt.DockWidgetArea.LeftDockWidgetArea, Qt.DockWidgetArea.RightDockWidgetArea
WIDTHS = [265, 470]
"""Pixels that steps and landmarks have at first."""
HISTORY_HEIGHT = 150
"""Pixels, enough for the last changes beside the steps."""


def make_docks(window: MainWindow) -> list[QDockWidget]:
    """Return the docks of a window, in their places: the history hidden, the landmarks before Judge."""
    docks = []
    for title, widget, area in (
        ("Steps", window.steps, LEFT),
        ("Landmarks", window.landmarks, RIGHT),
        ("History", _make_history(window.session.undo_stack), LEFT),
        ("Judge", window.judge, RIGHT),
    ):
        dock = QDockWidget(title, window)
        dock.setObjectName(title)
        dock.setWidget(widget)
        dock.topLevelChanged.connect(lambda _on, dock=dock: show_dock_icons(dock, current_theme()))
        window.addDockWidget(area, dock)
        docks.append(dock)
    steps, landmarks, history, judge = docks
    history.hide()
    window.tabifyDockWidget(landmarks, judge)
    landmarks.raise_()
    window.resizeDocks([steps, landmarks], WIDTHS, Qt.Orientation.Horizontal)
    return docks


def _make_history(undo_stack: QUndoStack) -> QUndoView:
    history = QUndoView(undo_stack)
    history.setEmptyLabel("As opened")
    history.setMinimumHeight(HISTORY_HEIGHT)
    history.setAccessibleName("History of changes")
    history.setToolTip("Click a state to go back or forth to it")
    return history
