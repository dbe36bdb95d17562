"""Two states of weights and lambda, kept as A and B: taken again, or shown in turn."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject, QTimer, Signal

from flyreg_core import edits
from flyreg_core.project import Project
from flyreg_core.results import Results
from flyreg_gui.session import Session

NAMES = ("A", "B")
HALF_PERIOD_MS = 500
"""How long each is on show; once a second both were seen."""


class Blink(QObject):
    """Shows the results of A and B in turn, without a change of the project.

    Both are computed once, on the worker thread; then one takes the other's place at once.
    """

    changed = Signal()
    refused = Signal(str)  # why it cannot blink

    def __init__(
        self, session: Session, say: Callable[[str], None], parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._session, self._say = session, say
        self.is_on = False
        self._known: dict[str, tuple[Project, Results]] = {}
        self._timer = QTimer(self)
        self._timer.setInterval(HALF_PERIOD_MS)
        self._timer.timeout.connect(self.turn)
        session.ran_beside.connect(self._on_results)
        session.failed_beside.connect(self._on_failed)
        session.project_changed.connect(self._on_project)

    def keep(self, name: str) -> None:
        """Remember the weights and lambda of now."""
        project = self._session.project
        if project is not None:
            self._session.edit(f"keep as {name}", edits.keep_snapshot(project, name))
            self._say(f"Kept weights and λ as {name}")

    def take(self, name: str) -> None:
        """Go back to weights and lambda that were kept."""
        project = self._session.project
        if project is not None and name in project.snapshots:
            self._session.edit(f"take {name}", edits.take_snapshot(project, name))

    def set_on(self, on: bool) -> None:
        """Begin or end blinking."""
        project = self._session.project
        kept = project.snapshots if project is not None else {}
        on = on and self._session.is_up_to_date and all(name in kept for name in NAMES)
        if on != self.is_on:
            self.is_on = on
            if on:
                self._go_on()
            else:
                self._timer.stop()
                self._session.show_own()
        self.changed.emit()

    def turn(self) -> None:
        """Show the other one."""
        name = NAMES[1] if self._session.beside == NAMES[0] else NAMES[0]
        self._session.show_beside(self._known[name][1], name)

    def _go_on(self) -> None:
        """Have computed what is missing, then blink."""
        project = self._session.project
        if project is None:
            return
        for name in NAMES:
            wanted = edits.take_snapshot(project, name)
            if name not in self._known or self._known[name][0] != wanted:
                self._known.pop(name, None)
                self._session.run_beside(wanted)
                return
        self.turn()
        self._timer.start()

    def _on_results(self, project: Project, results: Results) -> None:
        current = self._session.project
        if current is None or not self.is_on:
            return
        for name in NAMES:
            if name in current.snapshots and edits.take_snapshot(current, name) == project:
                self._known[name] = (project, results)
        self._go_on()

    def _on_failed(self, sentence: str) -> None:
        if self.is_on:
            self.set_on(False)
            self.refused.emit(f"A and B cannot be shown in turn: {sentence}")

    def _on_project(self, project: Project | None) -> None:
        if self.is_on:
            self.set_on(False)
        if project is None or self._session.results is None:
            self._known = {}
