"""Dragging landmarks in the views: over the surface or along their curve, in landmark mode only."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QPointF, Qt

from flyreg_core.project import Role
from flyreg_gui.landmark_mode import LandmarkMode, Point
from flyreg_gui.views.canvas import CLICK_RADIUS, Canvas

Finds = Callable[[QPointF], str | None]
Points = Callable[[QPointF], Point | None]


class LandmarkHand:
    """Takes the left button where it is pressed on a landmark; elsewhere the camera has it."""

    def __init__(
        self, canvas: Canvas, mode: LandmarkMode, role: Role, landmark_at: Finds, point_at: Points
    ) -> None:
        self.canvas, self._mode, self._role = canvas, mode, role
        self._landmark_at, self._point_at = landmark_at, point_at
        self._pressed, self._is_drag = QPointF(), False

    def set_on(self, on: bool) -> None:
        """Take hold of the button, or leave it to whoever has it."""
        if on:
            self.canvas.grabber = self
        elif self.canvas.grabber is self:
            self.canvas.grabber = None

    def press(self, position: QPointF) -> bool:
        """Take hold of the landmark at a position; tell whether there is one that moves."""
        identifier = self._landmark_at(position)
        if identifier is None or not self._mode.grab(identifier, self._role):
            return False
        self._pressed, self._is_drag = position, False
        return True

    def move(self, position: QPointF) -> None:
        """Move the landmark to what is under the mouse; beside the brain it stays."""
        away = position - self._pressed
        self._is_drag = self._is_drag or max(abs(away.x()), abs(away.y())) > CLICK_RADIUS
        point = self._point_at(position) if self._is_drag else None
        if point is not None:
            self._mode.drag(point)

    def release(self) -> None:
        """Leave the landmark where it is; a press that moved nothing was a click."""
        self._mode.let_go()
        if not self._is_drag:
            self.canvas.clicked.emit(self._pressed, Qt.KeyboardModifier.NoModifier)

    def double_click(self, position: QPointF) -> bool:
        """Leave double clicks to others."""
        return False
