"""What is not saved yet is kept in a file of this program's own, and offered again after a crash."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import platformdirs
from PySide6.QtCore import QLockFile, QObject, QTimer, Signal

from flyreg_core.errors import FlyregError
from flyreg_core.files import make_folder
from flyreg_core.project import Project
from flyreg_core.project_file import load_project, read_notes, save_project
from flyreg_gui.failures import sentence_for
from flyreg_gui.session import Session
from flyreg_gui.steps import short_name

DEFAULT_SECONDS = 3
"""How long a change waits at most until it is kept."""
SUFFIX, LOCK_SUFFIX = ".flyreg", ".lock"
PATH, TIME, BRAINS = "path", "time", "brains"
"""The notes in an autosaved file: the project file it belongs to, when it was written, of what."""


def autosave_folder() -> Path:
    """Return where running programs keep what is not saved."""
    return platformdirs.user_state_path("flyreg", appauthor=False) / "autosave"


class Autosave(QObject):
    """Writes the project some seconds after a change, never over the user's own file.

    One file per running program, which holds a lock as long as it runs; the file goes when the
    project is saved or given up. It is written on a thread of its own, so that a slow disk does not
    halt the hand, and whole or not at all.
    """

    failed = Signal(str)  # the sentence for the user

    def __init__(
        self,
        session: Session,
        with_view: Callable[[Project], Project],
        parent: QObject | None = None,
        folder: Path | None = None,
    ) -> None:
        super().__init__(parent)
        self._session, self._with_view = session, with_view
        self._path = (folder or autosave_folder()) / f"{uuid.uuid4().hex}{SUFFIX}"
        self._lock: QLockFile | None = None  # until there is something to keep
        self._kept: Project | None = None  # what was written last, if it is still there
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self._save)
        self.set_seconds(DEFAULT_SECONDS)
        self._executor = ThreadPoolExecutor(max_workers=1, thread_name_prefix="flyreg-autosave")
        session.project_changed.connect(self._on_news)
        session.state_changed.connect(self._on_news)

    def set_seconds(self, seconds: float) -> None:
        """Say how long a change may wait."""
        self._timer.setInterval(round(1000 * seconds))

    @property
    def seconds(self) -> float:
        """How long a change waits at most."""
        return self._timer.interval() / 1000

    def save_now(self) -> bool:
        """Keep what is not saved and wait until it is on the disk; tell whether it is."""
        written = self._save()
        return written is not None and written.result()

    def close(self) -> None:
        """End the thread, and drop what was kept; the user has decided about it."""
        self._timer.stop()
        self._session.project_changed.disconnect(self._on_news)
        self._session.state_changed.disconnect(self._on_news)
        self._drop()
        self._executor.shutdown(wait=True)
        if self._lock is not None:
            self._lock.unlock()

    def _on_news(self) -> None:
        session = self._session
        if not session.unsaved_changes:
            self._timer.stop()
            self._drop()
        elif session.project is not self._kept and not self._timer.isActive():
            self._timer.start()

    def _save(self) -> Future[bool] | None:
        project = self._session.project
        if project is None or not self._claim():
            return None
        self._kept, path = project, self._session.path
        notes = {
            PATH: None if path is None else str(path.absolute()),
            TIME: datetime.now().astimezone().isoformat(timespec="seconds"),
            BRAINS: f"{short_name(project.source.input)} on {short_name(project.target.input)}",
        }
        return self._executor.submit(self._write, self._with_view(project), notes)

    def _claim(self) -> bool:
        """Lock the file of this program, so that others know whose it is."""
        if self._lock is None:
            try:
                make_folder(self._path.parent)
            except FlyregError as error:
                self._complain(error)
                return False
            self._lock = lock_of(self._path)
            self._lock.tryLock(0)
        return True

    def _drop(self) -> None:
        if self._kept is not None:
            self._kept = None
            self._executor.submit(self._path.unlink, missing_ok=True)

    def _write(self, project: Project, notes: dict[str, str | None]) -> bool:  # on the thread
        try:
            save_project(project, self._path, notes)
        except (FlyregError, OSError) as error:
            self._complain(error)
            return False
        return True

    def _complain(self, error: Exception) -> None:
        self.failed.emit(f"changes are not kept for recovery: {sentence_for(error)}")


def lock_of(path: Path) -> QLockFile:
    """Return the lock of an autosaved file; it falls open when the program that holds it ends."""
    lock = QLockFile(str(path.with_suffix(LOCK_SUFFIX)))
    lock.setStaleLockTime(0)
    return lock


@dataclass(frozen=True, eq=False)
class LeftOver:
    """What a program that no longer runs had not saved; locked, so that one program offers it."""

    path: Path
    project_path: Path | None  # the file it belongs to; None if it was never saved
    time: datetime
    lock: QLockFile
    brains: str | None = None  # their names, for people

    def load(self) -> Project:
        """Return the project.

        Raises
        ------
        FlyregError
            See `project_file.load_project`.
        """
        return load_project(self.path)

    def discard(self) -> None:
        """Delete it, and what was half written when its program ended."""
        for part in (self.path, *self.path.parent.glob(f".{self.path.name}.*.part")):
            part.unlink(missing_ok=True)
        self.lock.unlock()

    def keep(self) -> None:
        """Leave it for the next start."""
        self.lock.unlock()

    @property
    def sentence(self) -> str:
        """What the user reads about it."""
        day = self.time.strftime("%d %B, %H:%M")
        if self.project_path is None:
            what = self.brains or "a project"
            return f"Recover {what} that was never saved, as it was on {day}?"
        name = self.project_path.name
        try:
            saved = datetime.fromtimestamp(self.project_path.stat().st_mtime).astimezone()
        except OSError:
            return f"Recover “{name}” as it was on {day}? The file itself is gone."
        seconds = (self.time - saved).total_seconds()
        than = "newer" if seconds >= 0 else "older"
        return f"Recover “{name}”, {in_words(abs(seconds))} {than} than the file?"


def find_left_overs(folder: Path | None = None) -> list[LeftOver]:
    """Return what programs that no longer run had not saved, the newest first."""
    found = []
    for path in (folder or autosave_folder()).glob(f"*{SUFFIX}"):
        lock = lock_of(path)
        if not lock.tryLock(0):
            continue
        try:
            notes = read_notes(path)
            written = datetime.fromtimestamp(path.stat().st_mtime).astimezone()
        except (FlyregError, OSError):
            lock.unlock()
            continue
        project = notes.get(PATH)
        belongs_to = None if project is None else Path(project)
        found.append(LeftOver(path, belongs_to, written, lock, notes.get(BRAINS)))
    return sorted(found, key=lambda left: left.time, reverse=True)


def in_words(seconds: float) -> str:
    """Return a length of time as people say it."""
    for unit, length in (("day", 86400), ("hour", 3600), ("minute", 60)):
        if seconds >= length:
            count = round(seconds / length)
            return f"{count} {unit}{'s' if count > 1 else ''}"
    return f"{max(round(seconds), 1)} second{'s' if seconds >= 1.5 else ''}"
