"""One drawing area: a VTK scene in a Qt widget, turned and pointed at by Qt's own events."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Protocol
from weakref import WeakMethod

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPointF, Qt, QTimer, Signal
from PySide6.QtGui import QEnterEvent, QKeyEvent, QMouseEvent, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QWidget
from pyvistaqt import QtInteractor

from flyreg_gui.theme import Theme, unit
from flyreg_gui.views.graphics import samples_per_pixel
from flyreg_gui.views.turns import Turns

Floats = NDArray[np.float64]

CLICK_RADIUS = 4.0
"""How far the mouse may move, in pixels, between press and release of a click."""
WHEEL_ZOOM = 1.15
"""Magnification by one notch of the wheel."""
SLOW_MS = 12.0
"""A scene that takes longer to draw is drawn lighter while a hand moves it: five make a picture."""
STILL_MS = 300
"""So long after the last notch of the wheel the scene stands still."""
NEAREST, FARTHEST = 0.1, 2.0
"""What is drawn of a plane scene, in heights of the camera over the plane."""


class Grabber(Protocol):
    """What takes the left button from the camera where it finds something to grab."""

    def press(self, position: QPointF) -> bool:
        """Take hold of what is at a position; tell whether there was anything."""

    def move(self, position: QPointF) -> None:
        """Follow the mouse."""

    def release(self) -> None:
        """Let go."""

    def double_click(self, position: QPointF) -> bool:
        """Act on a double click; tell whether there was anything to act on."""


class Canvas(QtInteractor):
    """A scene with a camera: left drag turns, middle or shift drag moves, right drag zooms.

    VTK sees none of these events: its own keys and gestures would clash with the window's. What
    changes the picture asks for `refresh`, and Qt draws at most once per frame. While something
    moves, a scene that is slow to draw is lighter: its layers leave out what they can.
    """

    clicked = Signal(QPointF, object)  # position in the widget, Qt.KeyboardModifiers
    hovered = Signal(QPointF)  # the mouse is there, no button pressed
    left = Signal()  # the mouse has gone, or turns the camera
    camera_moved = Signal()  # by the user's hand
    moving = Signal(bool)  # the user's hand moves the camera or what it grabbed, or has let go
    resized = Signal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent, auto_update=False, multi_samples=samples_per_pixel())
        self.setAcceptDrops(False)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setMinimumSize(120, 90)
        self._press: QPointF | None = None
        self._last = QPointF()
        self._is_drag = False
        self.grabber: Grabber | None = None  # of the mode that is on
        self.handle: Grabber | None = None  # in whatever mode, and asked first
        self.turns: Turns | None = None  # with the other canvases of the window
        self._held: Grabber | None = None
        self._layers: list[Callable[[], None]] = []
        self._is_moving = self._was_light = False
        self._milliseconds = 0.0  # that drawing the whole scene took
        self._stillness = QTimer(self)
        self._stillness.setSingleShot(True)
        self._stillness.setInterval(STILL_MS)
        self._stillness.timeout.connect(lambda: self.moving.emit(False))
        self.setMouseTracking(True)
        begin = WeakMethod(self._on_drawing)  # or VTK would keep the canvas for ever

        def before_drawing(*_event: object) -> None:
            if (on_drawing := begin()) is not None:
                on_drawing()

        self.renderer.AddObserver("StartEvent", before_drawing)

    def refresh(self) -> None:
        """Have the scene drawn again, soon and once; in turn with others that are slow to draw."""
        if self.turns is not None and self.is_slow:
            self.turns.ask(self)
        else:
            self.update()

    def before_drawing(self, prepare: Callable[[], None]) -> None:
        """Have a layer told whenever the scene is about to be drawn, after those told before."""
        self._layers.append(prepare)

    def set_moving(self, on: bool) -> None:
        """Take notice that a hand moves something, or has let go: then all is drawn again."""
        self._is_moving = on
        if not on and self._was_light:
            self.refresh()

    @property
    def is_slow(self) -> bool:
        """Tell whether drawing the whole scene takes too long under a hand."""
        return self._milliseconds > SLOW_MS

    @property
    def is_light(self) -> bool:
        """Tell whether layers are to leave out what they can."""
        return self._is_moving and self.is_slow

    def _on_drawing(self) -> None:
        for prepare in self._layers:
            prepare()
        self._was_light = self.is_light
        self._fit_depth()

    def _fit_depth(self) -> None:
        self.renderer.ResetCameraClippingRange()

    def paintGL(self) -> None:
        """Draw, and note how long that takes."""
        begun = time.perf_counter()
        super().paintGL()  # type: ignore[no-untyped-call]
        if not self._was_light:
            self._milliseconds = 1e3 * (time.perf_counter() - begun)
        if self.turns is not None:
            self.turns.drawn(self)

    def end(self) -> None:
        """End VTK, and let go of what Qt deletes after it.

        A Python object that outlives Qt's surface would be taken for the next thing at its address.
        """
        self.close()
        self._ctx = self._surface = self._gl = None
        self._layers.clear()
        self.grabber = self.handle = self._held = self.turns = None  # they hold the canvas

    def set_samples(self, samples: int) -> None:
        """Draw with so many samples per pixel from now on."""
        window: Any = self.ren_win
        window.SetMultiSamples(samples)

    def show_theme(self, theme: Theme) -> None:
        """Take the background of a theme."""
        self.renderer.SetBackground(*unit(theme.background))
        self.refresh()

    def to_pixels(self, points: Floats) -> tuple[Floats, Floats]:
        """Return where (n, 3) points appear, (n, 2) in the widget, and how far off, (n,)."""
        camera = self.renderer.GetActiveCamera()
        width, height = max(self.width(), 1), max(self.height(), 1)
        matrix = camera.GetCompositeProjectionTransformMatrix(width / height, -1, 1)
        values = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
        clip = np.column_stack([points, np.ones(len(points))]) @ values.T
        ndc = clip[:, :2] / clip[:, 3:]
        pixels = np.column_stack([(ndc[:, 0] + 1) * width / 2, (1 - ndc[:, 1]) * height / 2])
        offset = points - np.array(camera.GetPosition())
        return pixels, offset @ np.array(camera.GetDirectionOfProjection())

    def line_of_sight(self, position: QPointF) -> tuple[Floats, Floats]:
        """Return a point and the (3,) unit direction of all that appears at a position."""
        camera = self.renderer.GetActiveCamera()
        width, height = max(self.width(), 1), max(self.height(), 1)
        matrix = camera.GetCompositeProjectionTransformMatrix(width / height, -1, 1)
        values = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
        x, y = 2 * position.x() / width - 1, 1 - 2 * position.y() / height
        ends = np.linalg.solve(values, np.array([[x, y, -1.0, 1.0], [x, y, 1.0, 1.0]]).T).T
        near, far = ends[:, :3] / ends[:, 3:]
        return near, (far - near) / np.linalg.norm(far - near)

    def to_display(self, position: QPointF) -> tuple[float, float]:
        """Return a position in the widget as VTK counts: device pixels from the lower left."""
        window: Any = self.ren_win
        width, height = window.GetSize()
        return (
            position.x() / max(self.width(), 1) * width,
            (1 - position.y() / max(self.height(), 1)) * height,
        )

    def micrometres_per_pixel(self) -> float:
        """Return the length that one pixel spans at the camera's focal point."""
        camera = self.renderer.GetActiveCamera()
        if camera.GetParallelProjection():
            extent = 2 * camera.GetParallelScale()
        else:
            extent = 2 * camera.GetDistance() * np.tan(np.deg2rad(camera.GetViewAngle()) / 2)
        return float(extent) / max(self.height(), 1)

    # Qt's events

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin a click or a drag, of the camera or of what can be grabbed there."""
        self._press = self._last = event.position()
        self._is_drag = False
        is_left = event.button() == Qt.MouseButton.LeftButton
        asked = (self.handle, self.grabber) if is_left else ()
        self._held = next((each for each in asked if each and each.press(event.position())), None)
        event.accept()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Take the second press as any other, unless it means something where it is."""
        asked = (self.handle, self.grabber)
        if not any(each is not None and each.double_click(event.position()) for each in asked):
            self.mousePressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Turn, move or zoom once the mouse has left the place of the press."""
        if self._press is not None and not event.buttons():
            self._let_go()  # the release went elsewhere, to a dialog that opened meanwhile
        if self._press is None:
            self.hovered.emit(event.position())
            return
        position = event.position()
        moved = position - self._press
        is_far = self._held is not None or max(abs(moved.x()), abs(moved.y())) > CLICK_RADIUS
        if is_far and not self._is_drag:
            self._is_drag = True
            self.moving.emit(True)
        if self._held is not None:
            self._held.move(position)
        elif self._is_drag:
            self.left.emit()
            self._drag(position - self._last, event)
            self._last = position
            self.refresh()
            self.camera_moved.emit()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End a drag, or tell of a click."""
        is_click = self._press is not None and self._held is None and not self._is_drag
        self._let_go()
        if is_click and event.button() == Qt.MouseButton.LeftButton:
            self.clicked.emit(event.position(), event.modifiers())

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom at the mouse."""
        if not self._stillness.isActive():
            self.moving.emit(True)
        self._stillness.start()
        self.zoom_at(event.position(), WHEEL_ZOOM ** (event.angleDelta().y() / 120))
        self.refresh()
        self.camera_moved.emit()
        event.accept()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Tell that there is more or less room."""
        super().resizeEvent(event)
        self.resized.emit()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Leave keys to the window; VTK would quit at q."""
        event.ignore()

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """Leave keys to the window."""
        event.ignore()

    def enterEvent(self, event: QEnterEvent) -> None:
        """Keep from VTK that the mouse came."""
        event.accept()

    def leaveEvent(self, event: QEvent) -> None:
        """Keep from VTK that the mouse left."""
        self.left.emit()
        event.accept()

    # What a drag does

    def _let_go(self) -> None:
        held, self._held, self._press = self._held, None, None
        was_drag, self._is_drag = self._is_drag, False
        if held is not None:
            held.release()
        if was_drag:
            self.moving.emit(False)

    def _drag(self, step: QPointF, event: QMouseEvent) -> None:
        shift = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        if event.buttons() & Qt.MouseButton.MiddleButton or shift:
            self.pan(step)
        elif event.buttons() & Qt.MouseButton.RightButton:
            self.zoom_at(None, 1.01 ** -step.y())
        else:
            self.turn(step)

    def turn(self, step: QPointF) -> None:
        """Turn the camera around its focal point."""
        camera = self.renderer.GetActiveCamera()
        camera.Azimuth(-200 * step.x() / max(self.width(), 1))
        camera.Elevation(200 * step.y() / max(self.height(), 1))
        camera.OrthogonalizeViewUp()

    def pan(self, step: QPointF) -> None:
        """Move the scene with the mouse."""
        camera = self.renderer.GetActiveCamera()
        forward, up = np.array(camera.GetDirectionOfProjection()), np.array(camera.GetViewUp())
        right = np.cross(forward, up)
        shift = (-right * step.x() + up * step.y()) * self.micrometres_per_pixel()
        camera.SetPosition(*(np.array(camera.GetPosition()) + shift))
        camera.SetFocalPoint(*(np.array(camera.GetFocalPoint()) + shift))

    def zoom_at(self, position: QPointF | None, factor: float) -> None:
        """Magnify; what is at `position`, or in the middle, stays where it is."""
        camera = self.renderer.GetActiveCamera()
        center = QPointF(self.width() / 2, self.height() / 2)
        away = QPointF() if position is None else position - center
        self.pan(-away)
        if camera.GetParallelProjection():
            camera.SetParallelScale(camera.GetParallelScale() / factor)
        else:
            camera.Dolly(factor)
        self.pan(away)


class FlatCanvas(Canvas):
    """A canvas for plane things, seen from above: each drag moves, none turns."""

    def _fit_depth(self) -> None:
        """Leave the camera's range: the scene is never deeper than before."""

    def look_down(self, x: float, y: float, height: float) -> None:
        """Look at a place of the plane from above; all between the camera and the plane is drawn."""
        camera = self.renderer.GetActiveCamera()
        camera.SetPosition(x, y, height)
        camera.SetFocalPoint(x, y, 0)
        camera.SetClippingRange(NEAREST * height, FARTHEST * height)

    def turn(self, step: QPointF) -> None:
        """Move, because plane things do not turn."""
        self.pan(step)
