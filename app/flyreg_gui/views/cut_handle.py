"""The plane that cuts the brains, in each view in space, with a dot to drag it by."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, Qt

from flyreg_core.mesh import Floats
from flyreg_gui.panels.cut_bar import CutBar
from flyreg_gui.theme import Theme
from flyreg_gui.views.layers import DotLayer, SheetLayer
from flyreg_gui.views.picking import MARKER_REACH, way_along
from flyreg_gui.views.surface_view import SurfaceView

RIGHT, DORSAL = 0, 1
"""Rows of a view space's axes."""
MARGIN = 0.02
"""How far the plane stands out of the brain, as a share of its extent."""
OPACITY, OUTLINE = 0.05, 1.5
DOT, HALO = 15.0, 4.0
STEEPEST = 0.12
"""Squared sine between the line of sight and the dot's line below which the mouse's height counts."""


class CutHandle:
    """One view's outline of the plane, kept in step with the bar."""

    def __init__(self, bar: CutBar, view: SurfaceView) -> None:
        self._bar, self.view = bar, view
        self._sheet = SheetLayer(view.canvas, OPACITY, OUTLINE)
        self._dots = DotLayer(view.canvas, DOT, HALO)
        self._color = np.zeros((1, 3), dtype=np.uint8)
        self.dot: Floats | None = None  # (3,), where there is a plane
        self._line = np.zeros(3)  # along which it is dragged
        self._length = 1.0  # of the brain along that line, micrometres
        self._grip: tuple[Floats, QPointF, float] | None = None  # dot, mouse and share of before
        self._is_over, self._before = False, view.canvas.cursor()
        view.canvas.handle = self
        view.canvas.hovered.connect(self._on_hovered)

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        scale = self.view.canvas.devicePixelRatioF()
        self._color[:] = theme.busy
        self._sheet.set_color(theme.busy)
        self._sheet.set_width(OUTLINE * scale)
        self._dots.set_scale(scale)
        self.show()

    def show(self) -> None:
        """Draw the plane where the view is cut, or nothing."""
        cut, space = self.view.cut, self.view.space
        if cut is None or space is None:
            self.dot = None
            self._sheet.show([])
            self._dots.show(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.uint8))
            return
        self._line = space.axes[cut.axis]
        self._length = float(space.diagonal * space.size[cut.axis])
        middle = space.center + self._length * (cut.share - 0.5) * self._line
        reach = space.diagonal * (0.5 + MARGIN) * space.size[:, None] * space.axes
        first, second = (axis for axis in range(3) if axis != cut.axis)
        corners = [
            [middle + a * reach[first] + b * reach[second] for a in (-1, 1)] for b in (-1, 1)
        ]
        self.dot = middle + reach[RIGHT if cut.axis == DORSAL else DORSAL]
        self._sheet.show([np.array(corners)])
        self._dots.show(self.dot[None], self._color)
        self.view.canvas.refresh()

    # What the canvas asks

    def press(self, position: QPointF) -> bool:
        """Take hold of the dot."""
        cut = self.view.cut
        if cut is None or self.dot is None or not self.is_at(position):
            return False
        self._grip = (self.dot, position, cut.share)
        return True

    def move(self, position: QPointF) -> None:
        """Drag the plane so that its dot follows the mouse.

        Where the dot's line is seen nearly end on, a drag upwards brings the plane nearer.
        """
        if self._grip is None:
            return
        dot, before, share = self._grip
        canvas = self.view.canvas
        start = way_along(canvas, before, dot, self._line, STEEPEST)
        way = way_along(canvas, position, dot, self._line, STEEPEST)
        if start is None or way is None:
            _, sight = canvas.line_of_sight(before)
            up = (before.y() - position.y()) * canvas.micrometres_per_pixel()
            start, way = 0.0, -up * float(np.sign(self._line @ sight))
        self._bar.set_share(share + (way - start) / self._length)

    def release(self) -> None:
        """Let go of the dot."""
        self._grip = None

    def double_click(self, position: QPointF) -> bool:
        """Put the plane back to the middle."""
        is_meant = self.dot is not None and self.is_at(position)
        if is_meant:
            self._bar.set_share(0.5)
        return is_meant

    def is_at(self, position: QPointF) -> bool:
        """Tell whether the dot is at a position in the widget."""
        if self.dot is None:
            return False
        (pixel,), _ = self.view.canvas.to_pixels(self.dot[None])
        return bool(np.hypot(*(pixel - (position.x(), position.y()))) <= MARKER_REACH)

    def _on_hovered(self, position: QPointF) -> None:
        is_over = self.is_at(position)
        if is_over and not self._is_over:
            self._before = self.view.canvas.cursor()
            self.view.canvas.setCursor(Qt.CursorShape.OpenHandCursor)
        elif self._is_over and not is_over:
            self.view.canvas.setCursor(self._before)
        self._is_over = is_over
