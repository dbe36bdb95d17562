"""Drilling: a click on the front of a brain and one on its back make a channel between them."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from flyreg_core.edits import add_drill
from flyreg_core.handles import Point
from flyreg_core.project import Role
from flyreg_gui.session import Session


class DrillMode(QObject):
    """Whether clicks drill, and the end of a channel that waits for the other."""

    changed = Signal()

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.is_on = False
        self.start: tuple[Role, Point] | None = None
        session.results_changed.connect(self._on_news)
        session.remains_changed.connect(self._on_news)

    def set_on(self, on: bool) -> None:
        """Enter or leave the mode; leaving it forgets a half-made channel."""
        if on != self.is_on:
            self.is_on, self.start = on, None
            self.changed.emit()

    def abandon(self) -> bool:
        """Forget a half-made channel, or leave the mode; tell whether there was anything to end."""
        if self.start is not None:
            self.start = None
            self.changed.emit()
            return True
        was_on = self.is_on
        self.set_on(False)
        return was_on

    def place(self, role: Role, point: Point) -> None:
        """Take an end of the channel; the second one on the same brain drills it."""
        project = self._session.project
        if not self.is_on or project is None:
            return
        if self.start is None or self.start[0] != role:
            self.start = (role, point)
            self.changed.emit()
            return
        front = self.start[1]
        self.set_on(False)
        changed = add_drill(project, role, front, point)
        self._session.edit(f"drill a channel through the {role}", changed)

    @property
    def next_step(self) -> str:
        """What the user is to do now, for the status bar."""
        if not self.is_on:
            return ""
        if self.start is None:
            return "Drilling: click where the oesophagus opens at the front (Esc ends the mode)"
        return "Drilling: turn the brain and click where it opens at the back (Esc abandons)"

    def _on_news(self, news: object) -> None:
        if news is None and self._session.brain("source") is None:
            self.set_on(False)
        elif self.start is not None:  # the surface that was clicked is gone
            self.start = None
            self.changed.emit()
