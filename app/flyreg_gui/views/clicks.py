"""What a click in a view means: a tunnel, a landmark to select, or a place for a new one."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QPointF, Qt

from flyreg_core.project import Role
from flyreg_gui.landmark_mode import LandmarkMode, Point
from flyreg_gui.selection import Selection
from flyreg_gui.session import Session
from flyreg_gui.trim_mode import TrimMode
from flyreg_gui.views.flat_view import FlatView
from flyreg_gui.views.landmark_hand import LandmarkHand
from flyreg_gui.views.surface_view import SurfaceView

if TYPE_CHECKING:
    from flyreg_gui.views.view_area import ViewArea

CONTROL = Qt.KeyboardModifier.ControlModifier


class Clicks(QObject):
    """Listens to the views of an area; in landmark mode landmarks are dragged in them too."""

    def __init__(
        self,
        session: Session,
        selection: Selection,
        mode: LandmarkMode,
        trim: TrimMode,
        area: ViewArea,
    ) -> None:
        super().__init__(area)
        self._session, self._selection = session, selection
        self._mode, self._trim, self._area = mode, trim, area
        self._hands = [self._hand(view) for view in area.views]
        for view in area.views:
            view.canvas.clicked.connect(partial(self._on_clicked, view))
        mode.changed.connect(self._on_mode)

    def _hand(self, view: SurfaceView | FlatView) -> LandmarkHand:
        role: Role = "source" if view is self._area.source else "target"
        point_at = partial(self._point_at, view, role)
        return LandmarkHand(view.canvas, self._mode, role, view.landmark_at, point_at)

    def _on_mode(self) -> None:
        cursor = Qt.CursorShape.CrossCursor if self._mode.is_on else Qt.CursorShape.ArrowCursor
        for view in self._area.views:
            view.canvas.setCursor(cursor)
        for hand in self._hands:
            hand.set_on(self._mode.is_on)

    def _on_clicked(
        self, view: SurfaceView | FlatView, position: QPointF, modifiers: Qt.KeyboardModifier
    ) -> None:
        role = self._area.role_of(view)
        if role is not None and self._trim.is_on:
            return
        if role is not None and self._area.tunnel_views.click(role, position):
            return
        identifier = view.landmark_at(position)
        if self._mode.is_on and not (identifier and self._mode.is_own(identifier)):
            role = role or self._role_to_place(view)
            point = self._point_at(view, role, position)
            if point is not None:
                self._mode.place(role, point)
            return
        if identifier is None:
            if not modifiers & CONTROL:
                self._selection.clear()
        elif modifiers & CONTROL:
            self._selection.toggle(identifier)
        else:
            self._selection.select([identifier])

    def _point_at(
        self, view: SurfaceView | FlatView, role: Role, position: QPointF
    ) -> Point | None:
        """Return the point of a brain that appears at a position of any view."""
        results, place = self._session.results, self._area.pointer.at(view, position)
        if results is None or place is None:
            return None
        if role == "source":
            x, y, z = place.source.on(results.source.surface).tolist()
        else:
            x, y, z = place.target.on(results.target.surface).tolist()
        return x, y, z

    def _role_to_place(self, view: SurfaceView | FlatView) -> Role:
        """Return the brain that a click means where both are on show.

        Where the registered brain lies on the target that is the target; laid flat, a new landmark
        begins with the place of the source that is drawn there and ends with the target's.
        """
        current = self._mode.current
        is_begun = current is not None and current.source is not None
        return "target" if view is self._area.registered or is_begun else "source"
