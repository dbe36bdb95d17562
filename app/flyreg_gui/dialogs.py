"""Questions to the user: which brains, what to do with unsaved changes; and the help texts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum, auto
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QDoubleSpinBox,
    QFileDialog,
    QGridLayout,
    QLabel,
    QMessageBox,
    QPushButton,
    QWidget,
)

from flyreg_core import mesh_formats, point_formats, volume_formats
from flyreg_core.brain_files import READ, open_brain, template_labels
from flyreg_core.errors import FlyregError, InputError
from flyreg_core.project import BrainInput, Unit
from flyreg_gui.preferences import Preferences

BRAIN_FILTER = ";;".join(
    f"{title} ({' '.join(f'*{ending}' for ending in sorted(endings))})"
    for title, endings in (
        ("Brains", READ),
        ("Meshes", mesh_formats.ENDINGS),
        ("Point clouds", point_formats.ENDINGS),
        ("Label volumes", volume_formats.ENDINGS),
    )
)
BRAIN_FILTER += ";;All files (*)"
MOST_VOXEL_UM = 100.0
MOST_LISTED = 8
"""As many files are named that would be replaced."""
UNITS: tuple[tuple[str, Unit | None], ...] = (
    ("find out", None),
    ("µm", "um"),
    ("nm", "nm"),
    ("mm", "mm"),
)


VoxelSize = tuple[float, float, float]


def lacks_voxel_size(name: str) -> bool:
    """Tell whether a file is a volume that does not say how large its voxels are."""
    path = Path(name).expanduser()
    if not (path.is_file() and volume_formats.is_volume(path)):
        return False
    return not volume_formats.read_header(path).has_voxel_size


class VoxelSizeDialog(QDialog):
    """Asks for the edges of a voxel."""

    def __init__(self, name: str, size: VoxelSize, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Voxel size")
        text = QLabel(
            f"{Path(name).name} does not say how large its voxels are. State the edges of a voxel "
            "in micrometres; z is the distance between slices."
        )
        text.setWordWrap(True)
        text.setTextFormat(Qt.TextFormat.PlainText)
        grid = QGridLayout(self)
        grid.addWidget(text, 0, 0, 1, 3)
        self.edges = []
        for column, (axis, value) in enumerate(zip("xyz", size, strict=True)):
            edge = QDoubleSpinBox()
            edge.setDecimals(4)
            edge.setRange(0.0001, MOST_VOXEL_UM)
            edge.setValue(value)
            edge.setPrefix(f"{axis}  ")
            edge.setSuffix(" µm")
            edge.setAccessibleName(f"Edge along {axis}")
            grid.addWidget(edge, 1, column)
            self.edges.append(edge)
        choices = QDialogButtonBox.StandardButton
        self.buttons = QDialogButtonBox(choices.Ok | choices.Cancel)
        self.buttons.accepted.connect(self.accept)
        self.buttons.rejected.connect(self.reject)
        grid.addWidget(self.buttons, 2, 0, 1, 3)
        self.setMinimumWidth(420)

    @property
    def voxel_size_um(self) -> VoxelSize:
        """The edges along x, y and z, micrometres."""
        x, y, z = (edge.value() for edge in self.edges)
        return x, y, z


class BrainChooser:
    """One row of the dialog: a file or a template, and its unit."""

    def __init__(self, role: str, preferences: Preferences, parent: QDialog) -> None:
        self._preferences, self._parent = preferences, parent
        self._voxel_size: VoxelSize = (1.0, 1.0, 1.0)  # as stated last
        self.label = QLabel(role)
        self.name = QComboBox()
        self.name.setEditable(True)
        self.name.addItems(["", *template_labels()])
        self.name.setMinimumWidth(340)
        self.name.setAccessibleName(f"{role} brain")
        edit = self.name.lineEdit()
        if edit is not None:
            edit.setPlaceholderText("a file, or the name of a template")
        self.browse = QPushButton("Browse…")
        self.unit = QComboBox()
        self.unit.addItems([text for text, _ in UNITS])
        self.unit.setAccessibleName(f"Unit of the {role.lower()} brain")
        self.browse.clicked.connect(self._on_browse)

    def open(self) -> BrainInput:
        """Open what was chosen; ask how large the voxels of a volume are if it does not say so."""
        name, unit = self.name.currentText().strip(), UNITS[self.unit.currentIndex()][1]
        size = None
        if lacks_voxel_size(name):
            dialog = VoxelSizeDialog(name, self._voxel_size, self._parent)
            is_answered = dialog.exec() == QDialog.DialogCode.Accepted
            if is_answered:
                size = self._voxel_size = dialog.voxel_size_um
            dialog.deleteLater()
            if not is_answered:
                raise InputError(f"{name} does not say how large its voxels are; state it")
        return open_brain(name, unit, voxel_size_um=size)

    def _on_browse(self) -> None:
        folder = self._preferences.folder
        path, _ = QFileDialog.getOpenFileName(
            self._parent, f"{self.label.text()} brain", folder, BRAIN_FILTER
        )
        if path:
            self._preferences.folder = str(Path(path).parent)
            self.name.setEditText(path)


class OpenBrainsDialog(QDialog):
    """Asks for a source and a target; stays open until both can be used."""

    def __init__(self, preferences: Preferences, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Open brains")
        self.source = BrainChooser("Source", preferences, self)
        self.target = BrainChooser("Target", preferences, self)
        self.inputs: tuple[BrainInput, BrainInput] | None = None
        self._problem = QLabel()
        self._problem.setWordWrap(True)
        self._problem.setTextFormat(Qt.TextFormat.PlainText)
        self._problem.hide()
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Open | QDialogButtonBox.StandardButton.Cancel
        )
        buttons.accepted.connect(self._on_accepted)
        buttons.rejected.connect(self.reject)
        self._open_button = buttons.button(QDialogButtonBox.StandardButton.Open)
        grid = QGridLayout(self)
        grid.addWidget(QLabel("Unit"), 0, 3)
        for row, chooser in enumerate((self.source, self.target), start=1):
            grid.addWidget(chooser.label, row, 0)
            grid.addWidget(chooser.name, row, 1)
            grid.addWidget(chooser.browse, row, 2)
            grid.addWidget(chooser.unit, row, 3)
            chooser.name.editTextChanged.connect(self._on_edited)
        hint = QLabel(
            "The source is moved onto the target; the target stays as it is. A brain is a mesh, a "
            "point cloud or a label volume."
        )
        hint.setWordWrap(True)
        grid.addWidget(hint, 3, 1, 1, 3)
        grid.addWidget(self._problem, 4, 0, 1, 4)
        grid.addWidget(buttons, 5, 0, 1, 4)
        grid.setColumnStretch(1, 1)
        self._on_edited()

    def _on_edited(self) -> None:
        named = all(chooser.name.currentText().strip() for chooser in (self.source, self.target))
        self._open_button.setEnabled(named)

    def _on_accepted(self) -> None:
        try:
            self.inputs = (self.source.open(), self.target.open())
        except FlyregError as error:
            self._problem.setText(str(error))
            self._problem.show()
        else:
            self.accept()


class Answer(Enum):
    """What to do with unsaved changes."""

    SAVE = auto()
    DISCARD = auto()
    CANCEL = auto()


def ask_about_changes(parent: QWidget, changes: list[str]) -> Answer:
    """Name the unsaved changes and ask what to do with them."""
    box = QMessageBox(parent)
    box.setIcon(QMessageBox.Icon.Question)
    box.setWindowTitle("Unsaved changes")
    box.setText("The project has changes that are not saved.")
    shown = [f"• {text}" for text in changes[-8:]]
    if len(changes) > len(shown):
        shown.insert(0, f"• {len(changes) - len(shown)} earlier ones")
    box.setInformativeText("\n".join(shown))
    buttons = QMessageBox.StandardButton
    box.setStandardButtons(buttons.Save | buttons.Discard | buttons.Cancel)
    box.setDefaultButton(buttons.Save)
    chosen = buttons(box.exec())
    return {buttons.Save: Answer.SAVE, buttons.Discard: Answer.DISCARD}.get(chosen, Answer.CANCEL)


def may_replace(parent: QWidget, paths: Sequence[Path]) -> bool:
    """Name the files that are there already, and ask whether they may be replaced."""
    there = [path for path in paths if path.is_file()]
    if not there:
        return True
    box = QMessageBox(parent)
    box.setIcon(QMessageBox.Icon.Warning)
    box.setWindowTitle("Replace files")
    is_one = len(there) == 1
    what = there[0].name if is_one else f"{len(there)} of the files"
    box.setText(f"{what} {'is' if is_one else 'are'} in {there[0].parent} already.")
    names = [path.name for path in there[:MOST_LISTED]]
    if len(there) > len(names):
        names.append(f"{len(there) - len(names)} others")
    box.setInformativeText(f"Replace {', '.join(names)}?")
    replace = box.addButton("Replace", QMessageBox.ButtonRole.AcceptRole)
    keep = box.addButton(QMessageBox.StandardButton.Cancel)
    box.setDefaultButton(keep)
    box.exec()
    is_agreed = box.clickedButton() is replace
    box.deleteLater()
    return is_agreed


def ask_for_saving_path(
    parent: QWidget,
    title: str,
    suggestion: Path,
    filters: str,
    suffix: str,
    beside: Callable[[Path], Sequence[Path]] = lambda path: (),
) -> Path | None:
    """Ask where to save; a name without a suffix gets the given one.

    Nothing is replaced unasked: not the file, nor those that are to be written `beside` it.
    """
    text, _ = QFileDialog.getSaveFileName(parent, title, str(suggestion), filters)
    if not text:
        return None
    path = Path(text)
    unasked = [] if path.suffix else [path.with_suffix(suffix)]  # by the file dialog
    path = path if path.suffix else path.with_suffix(suffix)
    return path if may_replace(parent, [*unasked, *beside(path)]) else None
