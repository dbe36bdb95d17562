"""The tunnels in the views of the two brains, and the channel that is being drilled."""

from __future__ import annotations

from functools import partial

import numpy as np
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtWidgets import QMenu

from flyreg_core.mesh import Floats
from flyreg_core.project import Role
from flyreg_gui.drill_mode import DrillMode
from flyreg_gui.session import Session
from flyreg_gui.theme import OESOPHAGUS, Theme
from flyreg_gui.tunnels import Tunnels
from flyreg_gui.views.layers import LineLayer
from flyreg_gui.views.rings import RingLayer
from flyreg_gui.views.surface_view import SurfaceView

DRILL_WIDTH = 4.0


class TunnelViews:
    """Draws rings and drills into the views, and takes the clicks that concern them."""

    def __init__(
        self, session: Session, tunnels: Tunnels, drill: DrillMode, views: dict[Role, SurfaceView]
    ) -> None:
        self._session, self._tunnels, self._drill = session, tunnels, drill
        self._views = views
        self.rings = {role: RingLayer(view.canvas) for role, view in views.items()}
        self._drills = {
            role: LineLayer(view.canvas, OESOPHAGUS, DRILL_WIDTH) for role, view in views.items()
        }
        self.menu: QMenu | None = None
        for role, view in views.items():
            self._drills[role].bring_to_front()
            view.canvas.hovered.connect(partial(self._on_hovered, role))
        tunnels.changed.connect(self._show)
        drill.changed.connect(self._on_drill)

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        for role, view in self._views.items():
            self.rings[role].show_theme(theme)
            self._drills[role].set_width(DRILL_WIDTH * view.canvas.devicePixelRatioF())

    def click(self, role: Role, position: QPointF) -> bool:
        """Act on a click in the view of a brain; tell whether it concerned tunnels."""
        view = self._views[role]
        if self._drill.is_on:
            point = view.point_at(position)
            if point is not None:
                self._drill.place(role, point)
            return True
        number = self.rings[role].at(position) if self._tunnels.is_on else None
        if number is not None:
            self._tunnels.choose((role, number))
            self._ask(view.canvas.mapToGlobal(position.toPoint()))
        elif self._tunnels.chosen is not None:
            self._tunnels.choose(None)
        return number is not None

    def _ask(self, place: QPoint) -> None:
        tunnel = self._tunnels.tunnel
        if tunnel is None:
            return
        menu = QMenu(self._views["source"].canvas.window())
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        take = menu.addAction("This is the oesophagus", self._tunnels.take)
        take.setEnabled(not tunnel.is_oesophagus or self._is_guess())
        menu.addAction("Not this one", self._tunnels.refuse)
        self.menu = menu
        menu.popup(place)

    def _is_guess(self) -> bool:
        chosen = self._tunnels.chosen
        brain = self._session.brain(chosen[0]) if chosen else None
        return brain is not None and brain.is_guess

    def _show(self) -> None:
        chosen = self._tunnels.chosen
        for role, rings in self.rings.items():
            brain = self._session.brain(role)
            if brain is None or not self._tunnels.is_on:
                rings.show((), None, False, 0.0)
            else:
                number = chosen[1] if chosen and chosen[0] == role else None
                rings.show(brain.tunnels, number, brain.is_guess, brain.raw.diagonal)

    def _on_drill(self) -> None:
        shape = Qt.CursorShape.CrossCursor if self._drill.is_on else Qt.CursorShape.ArrowCursor
        start = self._drill.start
        for role, view in self._views.items():
            view.canvas.setCursor(shape)
            is_here = start is not None and start[0] == role
            view.show_waiting_point(start[1] if start is not None and is_here else None)
            self._show_drill(role, None)

    def _on_hovered(self, role: Role, position: QPointF) -> None:
        start = self._drill.start
        if start is None or start[0] != role:
            return
        view, first = self._views[role], np.array(start[1])
        hit = view.point_at(position)
        if hit is not None:
            end = np.array(hit)
        else:  # beside the brain: as far off as where the channel begins
            origin, sight = view.canvas.line_of_sight(position)
            end = origin + sight * ((first - origin) @ sight)
        self._show_drill(role, np.stack([first, end]))

    def _show_drill(self, role: Role, ends: Floats | None) -> None:
        points = np.zeros((0, 3)) if ends is None else ends
        self._drills[role].show_pairs(points[:1], points[1:])
        self._views[role].canvas.refresh()
