"""The open project, how it changes, and what is known about it."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QUndoCommand, QUndoStack

from flyreg_core.errors import FlyregError, InputError
from flyreg_core.frame import BrainFrame
from flyreg_core.handles import Handle
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.project import Project, Role
from flyreg_core.results import PreparedBrain, Results
from flyreg_gui.failures import sentence_for
from flyreg_gui.preparing import PreparingError, RawBrain, Remains
from flyreg_gui.runner import Run, Runner

NO_GESTURE = -1
"""The id of edits that are undo steps of their own; Qt never merges commands that have it."""


@dataclass(frozen=True)
class Failure:
    """Why the newest project has no results."""

    sentence: str
    error: Exception
    work: str  # what was being done, as last reported

    @property
    def is_internal(self) -> bool:
        """Tell whether it is the program's fault, not the input's."""
        return not isinstance(self.error, FlyregError | OSError)


@dataclass(frozen=True, eq=False)
class BrainOnShow:
    """What is known of one brain: prepared, or only as read because preparing it failed."""

    raw: SurfaceMesh
    frame: BrainFrame
    tunnels: tuple[Handle, ...]
    prepared: PreparedBrain | None

    @property
    def is_guess(self) -> bool:
        """Tell whether the program chose the oesophagus and is not sure of it."""
        torus = self.prepared.torus if self.prepared is not None else None
        return torus is not None and torus.is_guess and self.tunnels is torus.handles


class Session(QObject):
    """The open project: the only place where it changes, and the only sender of the news."""

    project_changed = Signal(object)  # Project or None
    results_changed = Signal(object)  # Results or None
    remains_changed = Signal(object)  # Remains or None: what is left where preparing failed
    read_changed = Signal()  # what was read of the brains, before there are results
    state_changed = Signal()  # what runs, what failed, what is saved
    gesture_changed = Signal(bool)  # the user's hand is on it, or off again
    progressed = Signal(float, str)
    ran_beside = Signal(object, object)  # Project and Results that are not of the open project
    failed_beside = Signal(str)  # why there are none

    def __init__(self, runner: Runner, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.project: Project | None = None
        self.results: Results | None = None
        self.path: Path | None = None
        self.failure: Failure | None = None
        self.remains: Remains | None = None  # until there are results
        self.read: dict[Role, RawBrain] = {}  # until there are results
        self.seconds: float | None = None  # that the picture on show took, without measuring
        self.work = ""  # what the running work reported last
        self.undo_stack = QUndoStack(self)
        self._runner = runner
        self._gestures, self._gesture = itertools.count(1), NO_GESTURE
        self._first = 0  # runs with smaller numbers belong to a project that is closed
        self._shown = 0  # the run whose results are on show
        self._awaited = 0  # the newest run, until it ended one way or another
        self.beside = ""  # which other results are on show, instead of the project's own
        self._own: Results | None = None  # the project's, while others are on show
        self._runs_beside: set[int] = set()  # runs that are not of the open project
        self._is_recovered = False  # the project was opened with changes that are in no file of it
        runner.finished.connect(self._on_finished)
        runner.failed.connect(self._on_failed)
        runner.stopped.connect(self._on_stopped)
        runner.progressed.connect(self._on_progressed)
        self.undo_stack.cleanChanged.connect(self._on_clean_changed)

    # What is asked of the session

    def open(
        self, project: Project, path: Path | None = None, *, is_recovered: bool = False
    ) -> None:
        """Replace the project by another one; that cannot be undone.

        One that is recovered has changes that its file lacks.
        """
        self._gesture = NO_GESTURE
        self.undo_stack.clear()
        self.beside, self._own = "", None
        self._is_recovered = is_recovered
        if is_recovered:
            self.undo_stack.resetClean()
        self.path, self.results, self.seconds = path, None, None
        self.read = {}
        self._first = self._submit(project)
        self._set_remains(None)
        self.results_changed.emit(None)
        self._set(project, submit=False)

    def edit(self, text: str, project: Project) -> None:
        """Change the project; `text` says how, in the Edit menu."""
        if self.project is not None and project != self.project:
            self.undo_stack.push(_Replace(self, text, self.project, project, self._gesture))

    def begin_gesture(self) -> None:
        """From now until `end_gesture`, edits are one undo step: a slider drag, a landmark drag."""
        self._gesture = next(self._gestures)
        self.gesture_changed.emit(True)

    def end_gesture(self) -> None:
        """End what `begin_gesture` began."""
        self._gesture = NO_GESTURE
        self.gesture_changed.emit(False)
        self._measure()

    @property
    def is_in_gesture(self) -> bool:
        """Tell whether the user's hand is still on it."""
        return self._gesture != NO_GESTURE

    def run_again(self) -> None:
        """Run the project once more, after it was stopped."""
        if self.project is not None:
            self._set(self.project)

    def take_read(self, project: Project, role: Role, brain: RawBrain) -> None:
        """Take what was read of a brain of the open project, to be shown until it is prepared."""
        if project is self.project and self.results is None:
            self.read[role] = brain
            self.read_changed.emit()

    def run_beside(self, project: Project) -> None:
        """Run a project that is not the open one, for `show_beside`."""
        self._runs_beside.add(self._runner.submit(project).number)

    def show_beside(self, results: Results, name: str) -> None:
        """Put results of another project on show; nothing else changes."""
        if not self.beside:
            self._own = self.results
        self.beside, self.results = name, results
        self.results_changed.emit(results)
        self.state_changed.emit()

    def show_own(self) -> None:
        """Put the results of the open project on show again."""
        if self.beside:
            self.beside, self.results, self._own = "", self._own, None
            self.results_changed.emit(self.results)
            self._measure()
            self.state_changed.emit()

    def cancel(self) -> None:
        """Stop the work; the project and the results on show stay as they are."""
        self._runner.cancel()

    def mark_saved(self, path: Path) -> None:
        """Remember that the project is in this file as it is now."""
        self.path = path
        self._is_recovered = False
        self.undo_stack.setClean()
        self.state_changed.emit()

    # What can be asked about it

    @property
    def is_running(self) -> bool:
        """Tell whether results of the newest project are still to come."""
        return self._awaited > 0

    @property
    def is_up_to_date(self) -> bool:
        """Tell whether the results on show are those of the newest project."""
        results = self.results
        if results is None:
            return False
        return results.project is self.project or results.project == self.project

    @property
    def is_complete(self) -> bool:
        """Tell whether the results on show are up to date and measured."""
        results = self.results
        return self.is_up_to_date and results is not None and results.distances is not None

    def brain(self, role: Role) -> BrainOnShow | None:
        """Return what is known of a brain; None before it was read."""
        raw = self.remains.brains.get(role) if self.remains is not None else None
        if self.results is not None:
            prepared = self.results.source if role == "source" else self.results.target
            torus = prepared.torus
            tunnels = raw.tunnels if raw is not None and raw.tunnels else torus.handles
            return BrainOnShow(prepared.raw, torus.frame, tunnels, prepared)
        return None if raw is None else BrainOnShow(raw.surface, raw.frame, raw.tunnels, None)

    @property
    def unsaved_changes(self) -> list[str]:
        """What was changed since the project was saved or opened, oldest first."""
        stack = self.undo_stack
        if self.project is None or stack.isClean():
            return []
        if self._is_recovered:
            texts = [stack.text(i) for i in range(stack.index())]
            return ["changes recovered", *dict.fromkeys(texts)]
        if stack.cleanIndex() < 0 or stack.cleanIndex() > stack.index():
            return ["changes taken back by undo"]
        texts = [stack.text(i) for i in range(stack.cleanIndex(), stack.index())]
        return list(dict.fromkeys(texts))

    # How news comes in

    def _set(self, project: Project, *, submit: bool = True) -> None:
        self.project = project
        self.failure = None
        if self.results is not None:
            self._set_remains(None)
        if submit:
            self._submit(project)
        self.project_changed.emit(project)
        self.state_changed.emit()

    def _submit(self, project: Project, *, measure: bool = False) -> int:
        self.work = ""
        self._awaited = self._runner.submit(project, measure=measure).number
        return self._awaited

    def _measure(self) -> None:
        """Have the distances measured, once the hand rests and the picture is up to date."""
        results = self.results
        if results is None or results.distances is not None or self.project is None:
            return
        if not self.is_in_gesture and not self.is_running and self.is_up_to_date:
            self._submit(self.project, measure=True)

    def _on_finished(self, run: Run, results: Results, seconds: float) -> None:
        if run.number in self._runs_beside:
            self.ran_beside.emit(run.project, results)
            return
        self._end(run)
        if run.number >= self._first and run.number > self._shown:
            self._shown = run.number
            self.results, self.read = results, {}
            self._set_remains(None)
            if not run.measure:
                self.seconds = seconds
            self.results_changed.emit(results)
            self._measure()
        self.state_changed.emit()

    def _on_failed(self, run: Run, error: Exception) -> None:
        if run.number in self._runs_beside:
            self.failed_beside.emit(sentence_for(error))
            return
        prefix = ""
        if isinstance(error, PreparingError):
            remains, error = error.remains, error.error
            prefix = "" if isinstance(error, InputError) else f"{remains.role.capitalize()}: "
            if run.number == self._awaited:
                self._set_remains(remains)
        sentence = prefix + sentence_for(error)
        if run.number == self._awaited:
            self.failure = Failure(sentence, error, self.work)
        self._end(run)
        self.state_changed.emit()

    def _on_stopped(self, run: Run) -> None:
        self._end(run)
        self.state_changed.emit()

    def _set_remains(self, remains: Remains | None) -> None:
        if remains is not self.remains:
            self.remains = remains
            self.remains_changed.emit(remains)

    def _end(self, run: Run) -> None:
        if run.number == self._awaited:
            self._awaited = 0

    def _on_progressed(self, run: Run, fraction: float, text: str) -> None:
        if run.number >= self._first:
            self.work = text
            self.progressed.emit(fraction, text)

    def _on_clean_changed(self, _clean: bool) -> None:
        self.state_changed.emit()


class _Replace(QUndoCommand):
    """One change of the project: back to the one before, forth to the one after."""

    def __init__(
        self, session: Session, text: str, before: Project, after: Project, gesture: int
    ) -> None:
        super().__init__(text)
        self._session, self._before, self._after = session, before, after
        self._gesture = gesture

    def redo(self) -> None:
        self._session._set(self._after)

    def undo(self) -> None:
        self._session._set(self._before)

    def id(self) -> int:
        return self._gesture

    def mergeWith(self, other: QUndoCommand) -> bool:
        if not isinstance(other, _Replace):
            return False
        self._after = other._after
        self.setObsolete(self._after == self._before)
        return True


def with_view(project: Project, view: dict[str, object]) -> Project:
    """Return the project with what the window is to restore; not an edit, so not undone."""
    return replace(project, view=view)
