"""One cursor in all views: what the mouse points at in one is marked at the same place in the others."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QObject, QPoint, QPointF, Qt, QTimer, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

from flyreg_core.frame import LEFT_RIGHT
from flyreg_core.mesh import Floats
from flyreg_core.results import Results
from flyreg_core.same_place import PlaceFinder, SamePlace
from flyreg_gui.session import Session
from flyreg_gui.theme import Color
from flyreg_gui.views.canvas import Canvas
from flyreg_gui.views.flat_view import FlatView
from flyreg_gui.views.picking import is_open
from flyreg_gui.views.surface_view import SurfaceView

if TYPE_CHECKING:
    from flyreg_gui.views.view_area import ViewArea

FRAME_MS = 16
"""The mark follows the mouse at most this often."""
COLOR: Color = (120, 255, 90)
RIM: Color = (10, 40, 10)
RADIUS, ARM = 7.0, 12.0
"""Of the ring, and how far its four arms reach, in pixels."""
MIDDLE = 15
"""Of the mark's widget, from its corner."""
FAR = 20_000.0
"""Pixels; what lies beyond is drawn nowhere, and Qt counts no further."""
HIDDEN = 0.45
"""Opacity of the mark where the brain lies before it."""
CLEARANCE = 0.004
"""A place so little behind the surface, in diagonals, is not hidden by it."""


class CursorMark(QWidget):
    """A ring with four arms over a view, before everything.

    It lies beside the canvas in its frame and not in it, or Qt would draw the scene anew for each
    of its steps.
    """

    def __init__(self, canvas: Canvas) -> None:
        super().__init__(canvas.parentWidget())
        self._canvas = canvas
        self._point: Floats | None = None
        self._opacity = 1.0
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.resize(2 * MIDDLE, 2 * MIDDLE)
        self.hide()
        canvas.camera_moved.connect(self._place)
        canvas.resized.connect(self._place)

    def show_at(self, point: Floats | None, opacity: float = 1.0) -> None:
        """Mark a (3,) point of the scene, or none."""
        self._point, self._opacity = point, opacity
        self._place()
        self.update()

    @property
    def point(self) -> Floats | None:
        """What is marked."""
        return self._point

    def _place(self) -> None:
        """Follow the point to where the camera shows it."""
        self.setVisible(self._point is not None and self._canvas.isVisible())
        if self._point is not None:
            pixels, _ = self._canvas.to_pixels(self._point[None])
            x, y = np.round(np.clip(pixels[0], -FAR, FAR)).astype(int)
            self.move(self._canvas.pos() + QPoint(int(x) - MIDDLE, int(y) - MIDDLE))
            self.raise_()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Draw the ring, first its dark rim."""
        with QPainter(self) as painter:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setOpacity(self._opacity)
            painter.translate(MIDDLE, MIDDLE)
            for color, width in ((RIM, 4.0), (COLOR, 1.8)):
                painter.setPen(QPen(QColor(*color), width))
                painter.drawEllipse(QPointF(0, 0), RADIUS, RADIUS)
                for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1)):
                    start, end = QPointF(x, y) * RADIUS, QPointF(x, y) * ARM
                    painter.drawLine(start, end)


class Cursor(QObject):
    """Follows the mouse over the views and marks the place everywhere, without any run."""

    moved = Signal(str)  # where the place is, for people; empty: nowhere

    def __init__(self, session: Session, area: ViewArea) -> None:
        super().__init__(area)
        self._session, self._area = session, area
        self.marks = {view: CursorMark(view.canvas) for view in area.views}
        self._finder: PlaceFinder | None = None
        self._results: Results | None = None
        self._asked: tuple[SurfaceView | FlatView, QPointF] | None = None
        self.place: SamePlace | None = None
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(FRAME_MS)
        self._timer.timeout.connect(self._follow)
        for view in area.views:
            view.canvas.hovered.connect(partial(self._on_hovered, view))
            view.canvas.left.connect(self.leave)
        session.results_changed.connect(self._on_results)

    def leave(self) -> None:
        """Mark nothing any more."""
        self._asked = None
        self._show(None)

    def point_in(self, view: SurfaceView | FlatView) -> Floats | None:
        """Return where the place is in a view."""
        return self.marks[view].point

    def point_of(self, view: SurfaceView | FlatView | None) -> Floats | None:
        """Return the point of a view's scene that is pointed at, if the mouse is in it."""
        results, place, area = self._results, self.place, self._area
        if view is None or results is None or place is None:
            return None
        if isinstance(view, FlatView):
            return None if place.plane is None else view.raised_mark(place.plane)
        if view is area.target:
            return place.target.on(results.target.surface)
        brain = results.source if view is area.source else results.registration
        return place.source.on(brain.surface)

    def _on_hovered(self, view: SurfaceView | FlatView, position: QPointF) -> None:
        self._asked = (view, position)
        if not self._timer.isActive():
            self._timer.start()

    def _on_results(self, results: Results | None) -> None:
        self._results = results
        if results is None:
            self._finder = None
        self.leave()

    def _follow(self) -> None:
        if self._asked is not None:
            view, position = self._asked
            self._show(self.at(view, position))

    def at(self, view: SurfaceView | FlatView, position: QPointF) -> SamePlace | None:
        """Return the place that appears at a position of a view; None beside the brain."""
        if self._results is None or self._area.is_on_other_business(view):
            return None
        finder = self._up_to_date_finder(self._results)
        if isinstance(view, FlatView):
            return finder.from_plane(view.half, view.plane_at(position))
        hit = view.hit_at(position)
        if hit is None:
            return None
        return (
            finder.from_target(hit.place)
            if view is self._area.target
            else finder.from_source(hit.place)
        )

    def _up_to_date_finder(self, results: Results) -> PlaceFinder:
        if self._finder is None or self._finder.registration is not results.registration:
            flat = results.source.flat, results.target.flat
            self._finder = PlaceFinder(*flat, results.registration, self._finder)
        return self._finder

    def _show(self, place: SamePlace | None) -> None:
        if place is None and self.place is None:
            return
        self.place = place
        results, area = self._results, self._area
        points: dict[SurfaceView | FlatView, Floats | None] = dict.fromkeys(area.views)
        if place is not None and results is not None:
            points[area.source] = place.source.on(results.source.surface)
            points[area.target] = place.target.on(results.target.surface)
            points[area.registered] = place.source.on(results.registration.surface)
            for flat in area.flat_views:
                if place.plane is not None and flat.half == place.half:
                    points[flat] = flat.raised_mark(place.plane)
        for view, point in points.items():
            is_pointed_at = self._asked is not None and self._asked[0] is view
            if area.is_on_other_business(view) or is_pointed_at:
                point = None
            if point is not None or self.marks[view].point is not None:
                self.marks[view].show_at(point, _opacity(view, point))
        self.moved.emit("" if place is None or results is None else describe(place, results))


def _opacity(view: SurfaceView | FlatView, point: Floats | None) -> float:
    if point is None or isinstance(view, FlatView) or view.pickable_surface is None:
        return 1.0
    pixels, depths = view.canvas.to_pixels(point[None])
    surface = view.pickable_surface
    depth = float(depths[0]) - CLEARANCE * view.diagonal
    is_seen = surface.is_whole_at(point) and is_open(surface, QPointF(*pixels[0]), depth)
    return 1.0 if is_seen else HIDDEN


def describe(place: SamePlace, results: Results) -> str:
    """Return where a place is, in the coordinates of the two files."""
    here = place.source.on(results.source.surface)
    there = place.target.on(results.target.surface)
    left = results.target.frame.coordinates(there[None])[0, LEFT_RIGHT] > 0
    where = "trim cap" if place.half is None else f"{place.half} half"
    side = "left" if left else "right"
    return f"source {_numbers(here)}  target {_numbers(there)} µm  {where}, {side} side"


def _numbers(point: Sequence[float] | Floats) -> str:
    return "(" + ", ".join(f"{value:.1f}" for value in point) + ")"
