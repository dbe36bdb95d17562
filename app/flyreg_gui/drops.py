"""Files dragged onto the window: brains, a project, landmarks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QMimeData, QObject, QTimer
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QMessageBox

from flyreg_core.project import Role
from flyreg_gui.main import PROJECT_SUFFIX

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow

LANDMARK_ENDINGS = (".csv", ".fcsv", ".json", ".points")
"""Files taken for landmarks while brains are open; otherwise a .csv is a point cloud."""


class Drops(QObject):
    """Takes files that are dropped on the window."""

    def __init__(self, window: MainWindow) -> None:
        super().__init__(window)
        self._window = window
        window.setAcceptDrops(True)
        window.installEventFilter(self)

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Accept files; leave everything else to the window."""
        if isinstance(event, QDragEnterEvent) and paths_in(event.mimeData()):
            event.acceptProposedAction()
            return True
        if type(event) is QDropEvent and (paths := paths_in(event.mimeData())):
            event.acceptProposedAction()
            # the other program waits for the drop to end, so no question may be asked in it
            QTimer.singleShot(0, lambda: self.take(paths))
            return True
        return False

    def take(self, paths: list[Path]) -> None:
        """Open what was dropped."""
        files, session = self._window.files, self._window.session
        if len(paths) > 2:
            self._window.show_problem(
                f"{len(paths)} files were dropped; drop a source and a target, or one file"
            )
        elif paths[0].suffix.lower() == PROJECT_SUFFIX:
            files.open_project_file(paths[0])
        elif len(paths) == 2:
            files.open_brains(str(paths[0]), str(paths[1]))
        elif session.project is not None and paths[0].suffix.lower() in LANDMARK_ENDINGS:
            self._window.landmark_commands.import_from(paths[0])
        else:
            self._take_one(paths[0])

    def _take_one(self, path: Path) -> None:
        role = ask_for_role(self._window, path)
        if role is None:
            return
        if self._window.session.project is None:
            names = (str(path), "") if role == "source" else ("", str(path))
            self._window.files.open_brains(*names)
        else:
            self._window.files.replace_brain(role, path)


def paths_in(data: QMimeData) -> list[Path]:
    """Return the files of this computer in what is dragged."""
    return [Path(url.toLocalFile()) for url in data.urls() if url.isLocalFile()]


def ask_for_role(window: MainWindow, path: Path) -> Role | None:
    """Ask whether a brain is the source or the target."""
    box = QMessageBox(window)
    box.setIcon(QMessageBox.Icon.Question)
    box.setWindowTitle("A brain")
    box.setText(f"Is {path.name} the source, which is moved, or the target, which stays?")
    buttons = {
        "source": box.addButton("Source", QMessageBox.ButtonRole.AcceptRole),
        "target": box.addButton("Target", QMessageBox.ButtonRole.AcceptRole),
    }
    box.addButton(QMessageBox.StandardButton.Cancel)
    box.exec()
    clicked = box.clickedButton()
    box.deleteLater()
    if clicked is buttons["source"]:
        return "source"
    return "target" if clicked is buttons["target"] else None
