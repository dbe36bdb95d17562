"""Landmark mode: a click on one brain and a click on the other make a landmark pair."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from flyreg_core.edits import Role, add_pair
from flyreg_core.landmarks import LandmarkPair
from flyreg_core.project import Project
from flyreg_gui.selection import Selection
from flyreg_gui.session import Session

Point = tuple[float, float, float]


class LandmarkMode(QObject):
    """Whether clicks make landmarks, and the half of a pair that waits for the other."""

    changed = Signal()

    def __init__(
        self, session: Session, selection: Selection, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._session, self._selection = session, selection
        self.is_on = False
        self.waiting: dict[Role, Point] = {}
        session.results_changed.connect(self._on_results)

    def set_on(self, on: bool) -> None:
        """Enter or leave the mode; leaving it forgets a half-made pair."""
        if on != self.is_on:
            self.is_on = on
            self.waiting = {}
            self.changed.emit()

    def abandon(self) -> bool:
        """Forget a half-made pair; tell whether there was one."""
        had = bool(self.waiting)
        if had:
            self.waiting = {}
            self.changed.emit()
        return had

    def place(self, role: Role, point: Point) -> None:
        """Take a point on one of the brains; with one on the other it makes a pair."""
        project = self._session.project
        if not self.is_on or project is None:
            return
        self.waiting = {**self.waiting, role: point}
        if len(self.waiting) == 2:
            ends, self.waiting = self.waiting, {}
            pair = _new_pair(project, ends["source"], ends["target"])
            self._session.edit(f"add {pair.name}", add_pair(project, pair))
            self._selection.select([pair.id])
        self.changed.emit()

    @property
    def next_step(self) -> str:
        """What the user is to do now, for the status bar."""
        if not self.is_on:
            return ""
        if "source" in self.waiting:
            return "Landmark mode: now click the same place on the target (Esc abandons)"
        if "target" in self.waiting:
            return "Landmark mode: now click the same place on the source (Esc abandons)"
        return "Landmark mode: click a place on the source or the target (Space ends the mode)"

    def _on_results(self, results: object) -> None:
        if results is None:
            self.set_on(False)


def _new_pair(project: Project, source: Point, target: Point) -> LandmarkPair:
    """Return a pair with the first name and id that are free."""
    ids, names = {pair.id for pair in project.pairs}, {pair.name for pair in project.pairs}
    number = next(
        n
        for n in range(1, len(project.pairs) + 2)
        if f"user-{n}" not in ids and f"Landmark {n}" not in names
    )
    return LandmarkPair(f"user-{number}", f"Landmark {number}", "interior", None, source, target)
