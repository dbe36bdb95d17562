"""Brains as they were read, in their views: until they are prepared, or where they cannot be."""

from __future__ import annotations

from collections.abc import Mapping

from flyreg_core.edits import brain_of
from flyreg_core.project import Role
from flyreg_core.relief import relief_colors
from flyreg_gui.session import Session
from flyreg_gui.steps import short_name
from flyreg_gui.theme import SOURCE, TARGET, Color
from flyreg_gui.views.camera import ViewSpace
from flyreg_gui.views.surface_view import SurfaceView
from flyreg_gui.views.view_frame import ViewFrame

COLORS: Mapping[Role, Color] = {"source": SOURCE, "target": TARGET}
COMING = "As read from the file. It is being prepared, which can take a minute the first time."


class RawViews:
    """Draws what was read of the brains, and says what becomes of it."""

    def __init__(
        self, session: Session, frames: Mapping[Role, ViewFrame], views: Mapping[Role, SurfaceView]
    ) -> None:
        self._session, self._frames, self._views = session, frames, views

    def show(self) -> None:
        """Draw what was read of the brains of a project that has no results yet."""
        session = self._session
        if session.project is None or session.results is not None:
            return
        remains = session.remains
        brains = session.read if remains is None else remains.brains
        for role, frame in self._frames.items():
            brain = brains.get(role)
            frame.set_empty(brain is None)
            if brain is None:
                continue
            frame.set_caption(COMING if remains is None else "")
            name = short_name(brain_of(session.project, role).input)
            fate = "as read" if remains is None else "as read: not prepared"
            frame.title.set_detail(f"{name}, {fate}")
            space = ViewSpace.of(brain.surface, brain.frame)
            colors = relief_colors(brain.surface, COLORS[role])
            self._views[role].show_surface(brain.surface, colors, space)
