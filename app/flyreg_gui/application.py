"""The running program: Qt's application, the window, and how both end."""

from __future__ import annotations

import gc
import sys
from pathlib import Path

from PySide6.QtCore import QObject, QTimer
from PySide6.QtWidgets import QApplication

from flyreg_core.brain_files import open_brain
from flyreg_core.cache import open_cache
from flyreg_core.errors import FlyregError
from flyreg_core.pipeline import Pipeline
from flyreg_core.project import Brain, Project, Unit
from flyreg_core.project_file import load_project
from flyreg_gui.failures import ExceptionCatcher, sentence_for
from flyreg_gui.files import demo_project
from flyreg_gui.main import INPUT_ERROR, INTERNAL_ERROR, Request
from flyreg_gui.main_window import MainWindow
from flyreg_gui.memory import keep_large_arrays_apart
from flyreg_gui.preferences import Preferences
from flyreg_gui.theme import set_scheme

SCREENSHOT_SIZE = (1600, 1000)
SETTLE_MS = 300
"""How long the window may take to draw after the results arrived."""


def run(request: Request) -> int:
    """Show the window for as long as the user wants it; return the exit status."""
    keep_large_arrays_apart()
    application = QApplication.instance() or QApplication(sys.argv[:1])
    assert isinstance(application, QApplication)
    application.setApplicationName("flyreg")
    application.setApplicationDisplayName("flyreg")
    application.setDesktopFileName("flyreg")
    try:
        project = requested_project(request)
    except (FlyregError, OSError) as error:
        if request.screenshot is not None:
            return _complain(sentence_for(error), INPUT_ERROR)
        project, problem = None, sentence_for(error)
    else:
        problem = ""
    set_scheme(Preferences().scheme)
    window = MainWindow(Pipeline(open_cache()))
    catcher = ExceptionCatcher(window)
    catcher.caught.connect(window.show_problem)
    previous_hook = sys.excepthook
    catcher.install()
    try:
        if project is not None:
            window.session.open(project, request.project)
        window.show_problem(problem)
        if request.screenshot is not None:
            return Photographer(window, request.screenshot).run(application)
        window.show()
        gc.freeze()  # what is there now stays, and takes no time when garbage is looked for
        window.recovery.look()
        if not window.preferences.has_toured:
            QTimer.singleShot(SETTLE_MS, window.tour.start)
        return application.exec()
    finally:
        sys.excepthook = previous_hook
        window.deleteLater()


def requested_project(request: Request) -> Project | None:
    """Return the project that the command line names; None if it names none."""
    if request.demo:
        return demo_project()
    if request.project is not None:
        return load_project(request.project)
    if request.brains is None:
        return None
    units: tuple[Unit | None, Unit | None] = (
        _unit(request.source_unit),
        _unit(request.target_unit),
    )
    sizes = (request.source_voxel_size, request.target_voxel_size)
    source, target = (
        Brain(open_brain(name, unit, voxel_size_um=size))
        for name, unit, size in zip(request.brains, units, sizes, strict=True)
    )
    return Project(source, target)


class Photographer(QObject):
    """Waits until the registration is on show, takes the picture, and closes the window."""

    def __init__(self, window: MainWindow, path: Path) -> None:
        super().__init__(window)
        self._window, self._path = window, path
        self._status = INTERNAL_ERROR
        self._is_ending = False
        window.session.state_changed.connect(self._on_state)

    def run(self, application: QApplication) -> int:
        """Show the window until the picture is taken; return the exit status."""
        self._window.resize(*SCREENSHOT_SIZE)
        self._window.show()
        self._on_state()
        application.exec()
        return self._status

    def _on_state(self) -> None:
        session = self._window.session
        if self._is_ending:
            return
        if session.failure is not None:
            status = INTERNAL_ERROR if session.failure.is_internal else INPUT_ERROR
            self._end(_complain(session.failure.sentence, status))
        elif session.is_complete:
            self._is_ending = True
            QTimer.singleShot(SETTLE_MS, self._take)

    def _take(self) -> None:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        if self._window.picture().save(str(self._path), "PNG"):
            self._end(0)
        else:
            self._end(
                _complain(f"{self._path} cannot be written; choose another file", INPUT_ERROR)
            )

    def _end(self, status: int) -> None:
        self._status, self._is_ending = status, True
        QTimer.singleShot(0, self._window.close)


def _unit(name: str | None) -> Unit | None:
    return name if name in ("nm", "um", "mm") else None  # type: ignore[return-value]


def _complain(sentence: str, status: int) -> int:
    sys.stderr.write(f"flyreg-gui: {sentence}\n")
    return status
