"""What a user does with the window: mouse and key events, and waiting for what follows."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPoint, QPointF, Qt, QTimer
from PySide6.QtGui import QCursor
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog, QLineEdit

from flyreg_core import edits
from flyreg_core.landmarks import LandmarkPair

LEFT = Qt.MouseButton.LeftButton
CONTROL = Qt.KeyboardModifier.ControlModifier
LONG_MS = 180_000


def settle(qtbot, window):
    """Wait until the newest project is on show and measured."""
    qtbot.waitUntil(lambda: window.session.is_complete, timeout=LONG_MS)
    QApplication.processEvents()


def activate(qtbot, window):
    """Have the window take the keys; asked once more whenever the display has not done it."""

    def is_active():
        window.activateWindow()
        return window.isActiveWindow()

    qtbot.waitUntil(is_active, timeout=LONG_MS)


def press(qtbot, window, key, modifier=Qt.KeyboardModifier.NoModifier):
    """Press a key with the window active, which a display without a window manager may forget."""
    activate(qtbot, window)
    qtbot.keyClick(window, key, modifier)


def drawn(view):
    """The vertices that a view draws."""
    return np.array(view.surface.polydata.points)


def pixel(canvas, point):
    """Where a point in space appears in a canvas."""
    pixels, _ = canvas.to_pixels(np.array([point]))
    return QPointF(*pixels[0]).toPoint()


def pulling_aside(results, place):
    """A pair that takes the source's surface nearest to a place 15 µm away on the target.

    Both ends lie on one half; on the caps of the trim planes nothing pulls, nor across the cut.
    """
    halves = results.source.halves.values()
    source, moved = results.source.surface.vertices, results.registration.surface.vertices
    nearest = [np.linalg.norm(source[half.vertex_of] - place, axis=1).min() for half in halves]
    own = list(halves)[int(np.argmin(nearest))].vertex_of
    start = own[np.linalg.norm(source[own] - place, axis=1).argmin()]
    away = np.linalg.norm(moved[own] - moved[start], axis=1)
    goal = own[np.abs(away - 15.0).argmin()]
    ends = (tuple(source[start].tolist()), tuple(moved[goal].tolist()))
    return LandmarkPair("mine", "mine", "interior", None, *ends, weight=100.0)


def open_with_a_pull(qtbot, window):
    """Open the project once more with a landmark that pulls aside: all others agree without a bend."""
    results = window.session.results
    mine = pulling_aside(results, results.landmarks[-1].source_point)
    window.session.open(edits.add_pair(window.session.project, mine))
    settle(qtbot, window)


def put_mouse_away():
    """Lay the display's own pointer where no window is; over one, it would take part in a test."""
    corner = QApplication.primaryScreen().geometry().bottomRight()
    QCursor.setPos(corner - QPoint(5, 5))


def hover(window, widget, position):
    """Move the mouse, no button pressed, to a place of a widget.

    The window is told of it at once and by itself. `qtbot.mouseMove` would move the display's
    pointer, of which the window hears later, and of some steps never.
    """
    for step in (QPoint(1, 0), QPoint(0, 0)):  # a mouse that is there already would not be told of
        QTest.mouseMove(window.windowHandle(), widget.mapTo(window, position + step))


def drag(qtbot, widget, positions, after_each):
    """Press at the first position, move through the others, release at the last."""
    qtbot.mousePress(widget, LEFT, pos=positions[0])
    for position in positions[1:]:
        qtbot.mouseMove(widget, position)
        after_each()
    qtbot.mouseRelease(widget, LEFT, pos=positions[-1])


def when_asked(kind, act):
    """Act on the next modal dialog of a kind."""

    def look():
        dialog = QApplication.activeModalWidget()
        if isinstance(dialog, kind):
            act(dialog)
        else:
            QTimer.singleShot(20, look)

    QTimer.singleShot(20, look)


def answer_file_dialog(*paths, line=None):
    """Choose a path in the next file dialog, another one in the dialog after it, and a kind of file.

    Typing it and clicking would be nearer to what users do, but Qt's own dialog enables its button
    only when a thread has read the folder, and every letter has it read again.
    """
    waiting = list(paths)

    def answer():
        dialog = QApplication.activeModalWidget()
        if isinstance(dialog, QFileDialog):
            if line is not None:
                dialog.selectNameFilter(line)
            dialog.findChild(QLineEdit, "fileNameEdit").setText(str(waiting.pop(0)))
            dialog.accept()
        if waiting:
            QTimer.singleShot(20, answer)

    QTimer.singleShot(20, answer)
