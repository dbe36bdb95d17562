"""Saving the report of what is on show, while the window stays alive."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Qt
from PySide6.QtWidgets import QProgressDialog

from flyreg_core.cost import with_cost
from flyreg_core.point_files import PointPairs
from flyreg_core.progress import Report
from flyreg_core.project_file import save_project
from flyreg_core.registration_error import register_report_on
from flyreg_core.report_page import write_report
from flyreg_core.results import Results
from flyreg_gui.dialogs import ask_for_saving_path
from flyreg_gui.failures import sentence_for
from flyreg_gui.points_dialog import PointsDialog
from flyreg_gui.work import Work

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow

SHOWN_AFTER_MS = 500


class ReportCommand(QObject):
    """Writes a page, its figures as JSON, and the project that repeats it, beside one another."""

    def __init__(self, window: MainWindow) -> None:
        super().__init__(window)
        self._window = window
        self._work: Work | None = None
        self._progress: QProgressDialog | None = None
        self._path = Path()

    def save(self) -> None:
        """Ask where to write the report of what is on show, and write it."""
        session = self._window.session
        if session.results is not None and session.is_complete and self._work is None:
            self._save(session.results, None)

    def save_on_points(self) -> None:
        """Ask for corresponding points too, and tell on the page how far they land from each other."""
        session = self._window.session
        if session.results is None or not session.is_complete or self._work is not None:
            return
        results = session.results
        dialog = PointsDialog(results.project, self._window.preferences, self._window)
        dialog.exec()
        truth = dialog.truth
        dialog.deleteLater()
        if truth is not None:
            self._save(results, truth)

    def _save(self, results: Results, truth: PointPairs | None) -> None:
        folder = Path(self._window.preferences.folder)
        path = ask_for_saving_path(
            *(self._window, "Save report", folder / "report.html", "Web page (*.html)", ".html"),
            lambda path: (path.with_suffix(".json"), project_beside(path)),
        )
        if path is not None:
            self._path = path
            self._start(Work(partial(write_all, path, results, truth), self))

    def close(self) -> None:
        """End what is being written; called when the window closes."""
        if self._work is not None:
            self._work.close()

    def _start(self, work: Work) -> None:
        progress = QProgressDialog("Writing the report", "Cancel", 0, 100, self._window)
        progress.setWindowTitle("Save report")
        progress.setWindowModality(Qt.WindowModality.WindowModal)
        progress.setMinimumDuration(SHOWN_AFTER_MS)
        progress.setAutoClose(False)
        progress.setAutoReset(False)
        progress.setValue(0)
        progress.canceled.connect(work.cancel)
        work.progressed.connect(self._on_progressed)
        work.finished.connect(self._on_finished)
        work.failed.connect(self._on_failed)
        work.stopped.connect(self._on_stopped)
        self._work, self._progress = work, progress
        work.start()

    def _on_progressed(self, fraction: float, text: str) -> None:
        if self._progress is not None:
            self._progress.setValue(min(round(100 * fraction), 99))

    def _on_finished(self, _result: object) -> None:
        self._end()
        self._window.say(f"Saved {self._path}")

    def _on_failed(self, error: Exception) -> None:
        self._end()
        self._window.show_problem(sentence_for(error))

    def _on_stopped(self) -> None:
        self._end()
        self._window.say("The report was not saved")

    def _end(self) -> None:
        if self._work is not None:
            self._work.close()
            self._work.deleteLater()
        if self._progress is not None:
            self._progress.close()
            self._progress.deleteLater()
        self._work = self._progress = None


def project_beside(page: Path) -> Path:
    """Return where the project is saved that repeats what a page reports."""
    return page.with_name(f"{page.stem}-project.flyreg")


def write_all(path: Path, results: Results, truth: PointPairs | None, report: Report) -> None:
    """Write the page, its figures, and the project, with names that begin alike.

    Raises
    ------
    InputError
        A file cannot be written.
    """
    project, facts = project_beside(path), register_report_on(truth, results)
    facts = with_cost(facts, sum(results.seconds.values()), results.seconds)
    write_report(path, project.name, results, facts, report)
    save_project(results.project, project)
