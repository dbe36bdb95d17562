"""flyreg beside other methods on the open pair of brains, beside the work."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QSize, Qt, QUrl, Signal
from PySide6.QtGui import QDesktopServices, QIcon, QImage, QPixmap
from PySide6.QtWidgets import (
    QFileDialog,
    QHBoxLayout,
    QLabel,
    QListView,
    QListWidget,
    QListWidgetItem,
    QProgressBar,
    QPushButton,
    QSpinBox,
    QVBoxLayout,
)

from flyreg_core.apart import Limits
from flyreg_core.comparison import CANCELLED, Row
from flyreg_core.comparison_pictures import PICTURE_TITLES, SIZE
from flyreg_core.comparison_report import row_report
from flyreg_core.picture import Picture
from flyreg_core.project import Project
from flyreg_gui.comparing import Answer, Question, answer, write_answer
from flyreg_gui.comparison_table import ComparisonTable
from flyreg_gui.dialogs import may_replace
from flyreg_gui.failures import sentence_for
from flyreg_gui.points_chooser import PointsChooser
from flyreg_gui.theme import css, current_theme
from flyreg_gui.work import Work
from flyreg_gui.working_dialog import WorkingDialog

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow

INTRODUCTION = (
    "Each method gets the same two prepared brains and runs in a process of its own. What a method "
    "cannot do is said in its row. Lengths are in µm."
)
WAITING = "waiting…"
ICON = QSize(216, 162)
MOST_SECONDS, MOST_MEGABYTES = 36_000, 1_000_000


class ComparisonDialog(WorkingDialog):
    """Methods to tick, points to measure by; rows that fill as methods end; then the files."""

    _told = Signal(object)  # Row, from the thread that compares

    def __init__(self, window: MainWindow) -> None:
        super().__init__(window)
        self.setWindowTitle("Compare with other methods")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._window = window
        self.answer: Answer | None = None
        self._page: Path | None = None  # of the answer, once it is written
        self.table = ComparisonTable()
        self.points = PointsChooser(window.preferences, self)
        self.seconds = _limit(Limits().seconds, MOST_SECONDS, " s", "Most time of each rival")
        self.megabytes = _limit(
            Limits().megabytes, MOST_MEGABYTES, " MB", "Most memory of each rival"
        )
        self.pictures = QListWidget()
        self.note = QLabel()
        self.bar = QProgressBar()
        self.start_button, self.cancel_button = QPushButton("Compare"), QPushButton("Cancel")
        self.save_button, self.page_button = QPushButton("Save…"), QPushButton("Open the page")
        self.close_button = QPushButton("Close")
        self._arrange()
        self._connect()
        self._show_busy(False)

    def _arrange(self) -> None:
        introduction = QLabel(INTRODUCTION)
        introduction.setWordWrap(True)
        self.note.setWordWrap(True)
        self.note.setTextFormat(Qt.TextFormat.PlainText)
        self.pictures.setViewMode(QListView.ViewMode.IconMode)
        self.pictures.setFlow(QListView.Flow.LeftToRight)
        self.pictures.setWrapping(False)
        self.pictures.setMovement(QListView.Movement.Static)
        self.pictures.setSelectionMode(QListWidget.SelectionMode.NoSelection)
        self.pictures.setIconSize(ICON)
        self.pictures.setFixedHeight(ICON.height() + 46)
        self.pictures.setAccessibleName("What each method makes of the source")
        self.bar.setRange(0, 100)
        limits = QHBoxLayout()
        limits.addWidget(QLabel("Each rival may take"))
        limits.addWidget(self.seconds)
        limits.addWidget(self.megabytes)
        limits.addStretch(1)
        below = QHBoxLayout()
        below.addWidget(self.start_button)
        below.addWidget(self.bar, 1)
        below.addWidget(self.cancel_button)
        below.addStretch(0)
        for button in (self.save_button, self.page_button, self.close_button):
            below.addWidget(button)
        layout = QVBoxLayout(self)
        layout.addWidget(introduction)
        layout.addWidget(self.table, 1)
        layout.addWidget(self.points)
        layout.addLayout(limits)
        layout.addWidget(self.pictures)
        layout.addWidget(self.note)
        layout.addLayout(below)
        self.pictures.hide()
        self.resize(1040, 760)

    def _connect(self) -> None:
        self._told.connect(self._on_told)
        self.table.itemChanged.connect(self._on_ticked)
        self.points.name.textChanged.connect(self._on_points)
        self.start_button.clicked.connect(self._on_start)
        self.cancel_button.clicked.connect(self._on_cancel)
        self.save_button.clicked.connect(self._on_save)
        self.page_button.clicked.connect(self._on_page)
        self.close_button.clicked.connect(self.close)
        self.start_button.setDefault(True)

    # The user's hand

    def _on_ticked(self, *_news: object) -> None:
        project = self._window.session.project
        is_ready = self._work is None and project is not None and bool(self.table.ticked)
        self.start_button.setEnabled(is_ready)

    def _on_points(self) -> None:
        self.table.show_errors(self.points.path is not None)

    def _on_start(self) -> None:
        project = self._window.session.project
        if project is None or self._work is not None:
            return
        limits = Limits(float(self.seconds.value()), float(self.megabytes.value()))
        methods = self.table.ticked
        question = Question(project, methods, self.points.path, self.points.unit, limits)
        self.answer = self._page = None
        self.table.clear_rows()
        for name in methods:
            self.table.say(name, WAITING)
        self.pictures.clear()
        self.pictures.hide()
        self._say(f"Comparing {_pair(project)}")
        self._begin(Work(partial(answer, question, self._told.emit), self), self._on_answered)

    def _on_cancel(self) -> None:
        if self._work is not None:
            self._work.cancel()

    def _on_save(self) -> None:
        found = self.answer
        if found is None:
            return
        preferences = self._window.preferences
        name = QFileDialog.getExistingDirectory(
            self, "Folder for the comparison", preferences.folder
        )
        if not name:
            return
        folder = Path(name)
        names = ["compare.json", "compare.csv", "compare.html", "compare.png"]
        for method in found.pictures:
            names += [f"{method}.png", f"{method}.ply"]
        if not may_replace(self, [folder / name for name in names]):
            return
        preferences.folder = name
        self._begin(Work(partial(write_answer, folder, found), self), self._on_saved)

    def _on_page(self) -> None:
        if self._page is not None:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(self._page)))

    # How it goes on

    def _begin(self, work: Work, on_finished: object) -> None:
        self._work = work
        work.progressed.connect(self._on_progressed)
        work.finished.connect(on_finished)
        work.failed.connect(self._on_failed)
        work.stopped.connect(self._on_stopped)
        self._show_busy(True)
        work.start()

    def _on_told(self, row: Row) -> None:
        if self._work is not None:
            self.table.show_row(row_report(row))

    def _on_progressed(self, fraction: float, text: str) -> None:
        self.bar.setValue(round(100 * fraction))
        self.bar.setFormat(f"%p %  {text}")

    def _on_answered(self, found: Answer) -> None:
        self._end()
        self.answer = found
        for name, picture in found.pictures.items():
            self.pictures.addItem(QListWidgetItem(_icon(picture), PICTURE_TITLES[name]))
        self.pictures.show()
        outside = found.comparison.points_outside
        left_out = f"; {outside} points are too far from the main brain and left out"
        cancelled = (
            "" if found.comparison.is_complete else "Cancelled; what was ready can be saved. "
        )
        self._say(
            f"{cancelled}{_pair(found.question.project)}, all from the front, at one scale"
            f"{left_out if outside else ''}"
        )
        self._show_busy(False)

    def _on_saved(self, page: Path) -> None:
        self._end()
        self._page = page
        self._say(f"Saved in {page.parent}")
        self._show_busy(False)

    def _on_failed(self, error: Exception) -> None:
        self._end()
        for name in self._waiting():
            self.table.describe(name)
        self._say(sentence_for(error), is_bad=True)

    def _on_stopped(self) -> None:
        self._end()
        for name in self._waiting():
            self.table.say(name, CANCELLED)
        early = "Cancelled before flyreg had registered; nothing is ready."
        self._say(early if self.answer is None else "Cancelled")

    def _waiting(self) -> list[str]:
        """Return the methods that came to nothing yet."""
        return [name for name in self.table.ticked if self.table.text(name, "Mean") == WAITING]

    def _say(self, text: str, *, is_bad: bool = False) -> None:
        self.note.setText(text)
        self.note.setStyleSheet(f"color: {css(current_theme().bad)};" if is_bad else "")

    def _show_busy(self, busy: bool) -> None:
        for widget in (self.bar, self.cancel_button):
            widget.setVisible(busy)
        self.start_button.setVisible(not busy)
        for inputs in (self.points, self.seconds, self.megabytes):
            inputs.setEnabled(not busy)
        self.table.set_ticking(not busy)
        self.save_button.setEnabled(not busy and self.answer is not None)
        self.page_button.setEnabled(not busy and self._page is not None)
        if busy:
            self.bar.setValue(0)
            self.bar.setFormat("%p %")
        self._on_ticked()


class ComparisonCommand(QObject):
    """Opens the dialog once, and closes it with the window."""

    def __init__(self, window: MainWindow) -> None:
        super().__init__(window)
        self._window = window
        self._dialog: ComparisonDialog | None = None

    def show(self) -> None:
        """Show the dialog, in front if it is open already."""
        if self._dialog is None:
            self._dialog = ComparisonDialog(self._window)
            self._dialog.destroyed.connect(self._on_destroyed)
        self._dialog.show()
        self._dialog.raise_()
        self._dialog.activateWindow()

    def close(self) -> None:
        """End what runs; called when the window closes."""
        if self._dialog is not None:
            self._dialog.close()

    def _on_destroyed(self) -> None:
        self._dialog = None


def _limit(value: float | None, most: int, suffix: str, name: str) -> QSpinBox:
    box = QSpinBox()
    box.setRange(1, most)
    box.setGroupSeparatorShown(True)
    box.setValue(round(value or most))
    box.setSuffix(suffix)
    box.setToolTip(f"{name}; what takes more is ended. flyreg itself has no limit")
    box.setAccessibleName(name)
    return box


def _pair(project: Project) -> str:
    return f"{project.source.input.name} on {project.target.input.name}"


def _icon(picture: Picture) -> QIcon:
    width, height = SIZE
    image = QImage(picture.tobytes(), width, height, 4 * width, QImage.Format.Format_RGBA8888)
    return QIcon(QPixmap.fromImage(image))
