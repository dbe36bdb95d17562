"""Choosing a source and a target among the templates of flybrains, by their pictures."""

from __future__ import annotations

from PySide6.QtCore import QModelIndex, QSize, Qt
from PySide6.QtGui import QIcon, QImage, QPixmap, QStandardItem, QStandardItemModel
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QGridLayout,
    QLabel,
    QLineEdit,
    QListView,
    QPushButton,
    QWidget,
)

from flyreg_core.brain_files import open_brain
from flyreg_core.errors import FlyregError
from flyreg_core.project import BrainInput, Role
from flyreg_core.templates import is_installed, template_labels, template_unit
from flyreg_gui.preparing import ROLES
from flyreg_gui.thumbnails import PROBLEM, SIZE, VERTICES, Thumbnails

NOT_INSTALLED = (
    "There are no templates here, because the package flybrains is not installed. Install it with "
    "“pip install flyreg[templates]”, or open your own files."
)


class TemplateBrowser(QDialog):
    """A picture per template; one is taken as source, one as target."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Open templates")
        self.inputs: tuple[BrainInput, BrainInput] | None = None
        self.chosen: dict[Role, str] = {}
        self._items: dict[str, QStandardItem] = {}
        self._model = QStandardItemModel(self)
        self._thumbnails = Thumbnails(self)
        self._thumbnails.drawn.connect(self._on_drawn)
        self.list = QListView()
        self.list.setModel(self._model)
        self.list.setViewMode(QListView.ViewMode.IconMode)
        self.list.setResizeMode(QListView.ResizeMode.Adjust)
        self.list.setMovement(QListView.Movement.Static)
        self.list.setIconSize(QSize(*SIZE))
        self.list.setUniformItemSizes(True)
        self.list.setSpacing(6)
        self.list.setEditTriggers(QListView.EditTrigger.NoEditTriggers)
        self.list.setAccessibleName("Templates")
        self.search = QLineEdit()
        self.search.setPlaceholderText("Find a template, such as FCWB or JRC2018")
        self.search.setClearButtonEnabled(True)
        self.search.setAccessibleName("Find a template")
        self.search.textChanged.connect(self._on_searched)
        self.search.returnPressed.connect(self._on_entered)
        hint = QLabel(
            "Double-click the brain that is to be moved, then the one that stays; or type the name "
            "of each and press Enter."
        )
        self.buttons = {role: QPushButton(f"Take as {role}") for role in ROLES}
        for button in self.buttons.values():
            button.setAutoDefault(False)  # or it would take Enter from the search
        self._names = {role: QLabel() for role in ROLES}
        self._problem = QLabel()
        self._problem.setWordWrap(True)
        self._problem.setTextFormat(Qt.TextFormat.PlainText)
        choices = QDialogButtonBox.StandardButton
        box = QDialogButtonBox(choices.Open | choices.Cancel)
        box.accepted.connect(self._on_accepted)
        box.rejected.connect(self.reject)
        self.open_button = box.button(choices.Open)
        grid = QGridLayout(self)
        grid.addWidget(self.search, 0, 0, 1, 2)
        grid.addWidget(self.list, 1, 0, 1, 2)
        grid.addWidget(hint, 2, 0, 1, 2)
        for row, role in enumerate(ROLES, start=3):
            self.buttons[role].clicked.connect(lambda _on, role=role: self._take(role))
            grid.addWidget(self.buttons[role], row, 0)
            grid.addWidget(self._names[role], row, 1)
        grid.addWidget(self._problem, 5, 0, 1, 2)
        grid.addWidget(box, 6, 0, 1, 2)
        grid.setColumnStretch(1, 1)
        grid.setRowStretch(1, 1)
        self.list.doubleClicked.connect(self._on_double_clicked)
        self.list.selectionModel().currentChanged.connect(self._show)
        self.finished.connect(self._thumbnails.close)
        self.resize(860, 640)
        self._fill()
        self._show()

    def _fill(self) -> None:
        blank = QPixmap(*SIZE)
        blank.fill(Qt.GlobalColor.transparent)
        for label in template_labels():
            item = QStandardItem(QIcon(blank), f"{label}\n{unit_in_words(label)}")
            item.setData(label)
            item.setTextAlignment(Qt.AlignmentFlag.AlignHCenter)
            self._items[label] = item
            self._model.appendRow(item)
            self._thumbnails.ask(label)
        if not is_installed():
            self._problem.setText(NOT_INSTALLED)

    def _on_searched(self, text: str) -> None:
        """Leave those whose name has the text, and go to the first of them."""
        shown = []
        for row, label in enumerate(self._items):
            is_found = text.strip().casefold() in label.casefold()
            self.list.setRowHidden(row, not is_found)
            shown += [row] if is_found else []
        if text and shown:
            self.list.setCurrentIndex(self._model.index(shown[0], 0))

    def _on_entered(self) -> None:
        """Take the brain that was found, and have the next name typed over this one."""
        self._on_double_clicked(self.list.currentIndex())
        self.search.selectAll()

    def _on_drawn(self, label: str, image: QImage) -> None:
        item = self._items[label]
        if problem := image.text(PROBLEM):
            item.setEnabled(False)
            item.setToolTip(problem)
            return
        item.setIcon(QIcon(QPixmap.fromImage(image)))
        count = f"{int(image.text(VERTICES)):,} vertices"
        item.setText(f"{label}\n{unit_in_words(label)}, {count}")
        item.setToolTip(f"{label}: {unit_in_words(label)}, {count}")

    @property
    def current(self) -> str | None:
        """The label of the template that the user is at."""
        item = self._model.itemFromIndex(self.list.currentIndex())
        return None if item is None else str(item.data())

    def _on_double_clicked(self, _index: QModelIndex) -> None:
        self._take("source" if "source" not in self.chosen else "target")

    def _take(self, role: Role) -> None:
        if self.current is not None:
            self.chosen[role] = self.current
            self._problem.clear()
        self._show()

    def _show(self, *_news: object) -> None:
        for role in ROLES:
            moves = "is moved" if role == "source" else "stays"
            label = self.chosen.get(role)
            self._names[role].setText(
                f"<b>{label}</b> {moves}" if label else f"The brain that {moves}"
            )
            self.buttons[role].setEnabled(self.current is not None)
        self.open_button.setEnabled(len(self.chosen) == len(ROLES))

    def _on_accepted(self) -> None:
        try:
            source, target = (open_brain(self.chosen[role], None) for role in ROLES)
        except FlyregError as error:
            self._problem.setText(str(error))
        else:
            self.inputs = (source, target)
            self.accept()


def unit_in_words(label: str) -> str:
    """Return the unit of a template as the user reads it."""
    unit = template_unit(label)
    return {"um": "µm", None: "no unit"}.get(unit, str(unit))
