"""Opening, saving and exporting, with the questions that belong to it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from flyreg_resources.demo import make_demo_pair
from PySide6.QtCore import QStandardPaths
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QFileDialog

from flyreg_core import edits
from flyreg_core.brain_files import open_brain, write_mesh
from flyreg_core.errors import FlyregError
from flyreg_core.project import Brain, BrainInput, Project, Role
from flyreg_core.project_file import load_project, save_project
from flyreg_core.report import write_registered
from flyreg_core.script import python_program, quoted, register_command
from flyreg_core.stated_command import only_in_a_file, stated_words
from flyreg_gui.dialogs import Answer, OpenBrainsDialog, ask_about_changes, ask_for_saving_path
from flyreg_gui.failures import sentence_for
from flyreg_gui.preferences import RecentBrain
from flyreg_gui.session import with_view
from flyreg_gui.steps import short_name
from flyreg_gui.template_browser import TemplateBrowser

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow

PROJECT_FILTER = "flyreg projects (*.flyreg);;All files (*)"
EXPORT_FILTER = (
    "PLY (*.ply);;Wavefront (*.obj);;STL (*.stl);;OFF (*.off);;glTF (*.glb);;VTK (*.vtk)"
)


class FileCommands:
    """What the File menu does."""

    def __init__(self, window: MainWindow) -> None:
        self._window = window
        self._session = window.session

    # Opening

    def open_brains(self, source: str = "", target: str = "") -> None:
        """Ask for two brains and open them; those that are known are filled in."""
        dialog = OpenBrainsDialog(self._window.preferences, self._window)
        dialog.source.name.setEditText(source)
        dialog.target.name.setEditText(target)
        dialog.exec()
        inputs = dialog.inputs
        dialog.deleteLater()
        if inputs is not None:
            self.open_pair(*inputs)

    def open_templates(self) -> None:
        """Ask for two templates by their pictures and open them."""
        dialog = TemplateBrowser(self._window)
        dialog.exec()
        inputs = dialog.inputs
        dialog.deleteLater()
        if inputs is not None:
            self.open_pair(*inputs)

    def open_pair(self, source: BrainInput, target: BrainInput) -> None:
        """Open two brains."""
        if self.may_discard():
            self._window.preferences.add_recent_pair(source, target)
            self._open(Project(Brain(source), Brain(target)))

    def open_recent_pair(self, source: RecentBrain, target: RecentBrain) -> None:
        """Open two brains as they were opened before."""
        try:
            inputs = [open_brain(b.name, b.unit, b.voxel_size_um) for b in (source, target)]
        except (FlyregError, OSError) as error:
            self._window.show_problem(sentence_for(error))
        else:
            self.open_pair(*inputs)

    def replace_brain(self, role: Role, path: Path) -> None:
        """Put another brain in the place of one of the two; the landmarks stay."""
        project = self._session.project
        if project is None:
            return
        try:
            brain = Brain(open_brain(str(path)))
        except (FlyregError, OSError) as error:
            self._window.show_problem(sentence_for(error))
        else:
            self._session.edit(f"open another {role}", edits.set_brain(project, role, brain))

    def open_project(self) -> None:
        """Ask for a project file and open it."""
        path, _ = QFileDialog.getOpenFileName(
            self._window, "Open project", self._window.preferences.folder, PROJECT_FILTER
        )
        if path:
            self.open_project_file(Path(path))

    def open_project_file(self, path: Path) -> None:
        """Open a project file."""
        try:
            project = load_project(path)
        except (FlyregError, OSError) as error:
            self._window.show_problem(sentence_for(error))
            return
        if self.may_discard():
            self._window.preferences.folder = str(path.parent)
            self._window.preferences.add_recent(path)
            self._open(project, path)

    def open_demo(self) -> None:
        """Write the demo pair and open it as any other pair of files."""
        try:
            project = demo_project()
        except (FlyregError, OSError) as error:
            self._window.show_problem(sentence_for(error))
            return
        if self.may_discard():
            self._open(project)

    def _open(self, project: Project, path: Path | None = None) -> None:
        self._window.show_problem("")
        self._session.open(project, path)

    # Saving

    def save(self) -> bool:
        """Save the project where it was saved before; tell whether it is saved now."""
        path = self._session.path
        return self.save_as() if path is None else self._save_to(path)

    def save_as(self) -> bool:
        """Ask where to save the project; tell whether it is saved now."""
        suggestion = self._session.path or Path(self._window.preferences.folder) / "project.flyreg"
        path = ask_for_saving_path(
            self._window, "Save project", suggestion, PROJECT_FILTER, ".flyreg"
        )
        return path is not None and self._save_to(path)

    def _save_to(self, path: Path) -> bool:
        project = self._session.project
        if project is None:
            return False
        try:
            save_project(with_view(project, self._window.view_state()), path)
        except (FlyregError, OSError) as error:
            self._window.show_problem(sentence_for(error))
            return False
        self._session.mark_saved(path)
        self._window.preferences.folder = str(path.parent)
        self._window.preferences.add_recent(path)
        self._window.say(f"Saved {path}")
        return True

    def may_discard(self) -> bool:
        """Tell whether the open project may go: nothing is unsaved, or the user was asked."""
        changes = self._session.unsaved_changes
        if not changes:
            return True
        answer = ask_about_changes(self._window, changes)
        return answer is Answer.DISCARD or (answer is Answer.SAVE and self.save())

    # Taking away

    def export(self) -> None:
        """Ask where to write the registered mesh, and write it."""
        results = self._session.results
        if results is None or not self._session.is_up_to_date:
            return
        project = results.project
        names = [Path(short_name(brain.input)).stem for brain in (project.source, project.target)]
        suggestion = Path(self._window.preferences.folder) / f"{names[0]}_on_{names[1]}.ply"
        path = ask_for_saving_path(
            self._window, "Export registered mesh", suggestion, EXPORT_FILTER, ".ply"
        )
        if path is None:
            return
        try:
            write_registered(path, results)
        except (FlyregError, OSError) as error:
            self._window.show_problem(sentence_for(error))
        else:
            self._window.say(f"Exported {path}")

    def copy_command(self) -> None:
        """Copy the command that repeats what is on show, with a project file only if it needs one."""
        session = self._session
        if session.project is None:
            return
        if session.path is not None and not session.unsaved_changes:
            self._copy(register_command(session.path), "The command")
        elif needed := only_in_a_file(session.project):
            self._window.show_problem(
                f"A command cannot say {' and '.join(needed)}; save the project (Ctrl+S), then copy "
                "the command again"
            )
        else:
            self._copy(quoted(stated_words(session.project)), "The command")

    def copy_python(self) -> None:
        """Copy a Python program that repeats what is on show."""
        project = self._session.project
        if project is not None:
            self._copy(python_program(project), "The Python program")

    def _copy(self, text: str, what: str) -> None:
        QGuiApplication.clipboard().setText(text)
        self._window.say(f"{what} that repeats this registration is on the clipboard")


def demo_project() -> Project:
    """Write the demo pair into the user's cache and return the project of it."""
    cache = QStandardPaths.writableLocation(QStandardPaths.StandardLocation.GenericCacheLocation)
    folder = Path(cache) / "flyreg" / "demo"
    folder.mkdir(parents=True, exist_ok=True)
    paths = (folder / "demo-source.ply", folder / "demo-target.ply")
    for path, mesh in zip(paths, make_demo_pair(), strict=True):
        write_mesh(path, mesh, "um")
    source, target = (Brain(open_brain(str(path), "um")) for path in paths)
    return Project(source, target)
