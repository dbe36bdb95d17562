"""The preferences: how the window looks, how soon changes are kept, and the keys of each action."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QIcon, QKeySequence
from PySide6.QtWidgets import (
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QHeaderView,
    QKeySequenceEdit,
    QLabel,
    QPushButton,
    QSpinBox,
    QTableWidget,
    QTableWidgetItem,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from flyreg_gui.theme import Scheme, css, current_theme

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow

SCHEMES: tuple[tuple[Scheme, str], ...] = (
    ("system", "as the system"),
    ("light", "light"),
    ("dark", "dark"),
)
MOST_SECONDS = 60


class PreferencesDialog(QDialog):
    """Shows the preferences; what is changed takes effect at once."""

    def __init__(self, window: MainWindow) -> None:
        super().__init__(window)
        self._window = window
        self.setWindowTitle("Preferences")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.scheme = QComboBox()
        self.scheme.addItems([text for _, text in SCHEMES])
        self.scheme.setAccessibleName("Colours of the window")
        self.seconds = QSpinBox()
        self.seconds.setRange(1, MOST_SECONDS)
        self.seconds.setSuffix(" s")
        self.seconds.setAccessibleName("Longest wait before changes are kept")
        self.keys = KeysPage(window)
        self._show()
        self.scheme.currentIndexChanged.connect(self._on_scheme)
        self.seconds.valueChanged.connect(window.set_autosave_seconds)
        general = QWidget()
        form = QFormLayout(general)
        form.addRow("Colours", self.scheme)
        form.addRow("Keep changes for recovery within", self.seconds)
        hint = QLabel(
            "After a crash, what was kept is offered at the next start. Your own files are only "
            "written when you save."
        )
        hint.setWordWrap(True)
        form.addRow(hint)
        tabs = QTabWidget()
        tabs.addTab(general, "General")
        tabs.addTab(self.keys, "Keys")
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        buttons.button(QDialogButtonBox.StandardButton.Close).setIcon(
            QIcon()
        )  # black, in the dark too
        buttons.rejected.connect(self.close)
        layout = QVBoxLayout(self)
        layout.addWidget(tabs)
        layout.addWidget(buttons)
        self.resize(620, 520)

    def _show(self) -> None:
        preferences = self._window.preferences
        self.scheme.setCurrentIndex([name for name, _ in SCHEMES].index(preferences.scheme))
        self.seconds.setValue(preferences.autosave_seconds)

    def _on_scheme(self, index: int) -> None:
        self._window.set_scheme(SCHEMES[index][0])


class KeysPage(QWidget):
    """One row per action: its name, its keys, and what changes them."""

    def __init__(self, window: MainWindow) -> None:
        super().__init__()
        self._keymap = window.keymap
        self.table = QTableWidget(len(self._keymap.names), 3)
        self.table.setHorizontalHeaderLabels(["Action", "Keys", "New key"])
        self.table.verticalHeader().hide()
        self.table.setAccessibleName("Keys of each action")
        self.table.setEditTriggers(QTableWidget.EditTrigger.NoEditTriggers)
        self.table.setSelectionMode(QTableWidget.SelectionMode.NoSelection)
        self.table.setTabKeyNavigation(False)
        self.edits: dict[str, QKeySequenceEdit] = {}
        for row, name in enumerate(self._keymap.names):
            edit = QKeySequenceEdit()
            edit.setMaximumSequenceLength(1)
            edit.setClearButtonEnabled(True)
            edit.setAccessibleName(f"New key of {self._keymap.text_of(name)}")
            edit.editingFinished.connect(lambda name=name: self._on_edited(name))
            self.edits[name] = edit
            self.table.setItem(row, 0, QTableWidgetItem(self._keymap.text_of(name)))
            self.table.setItem(row, 1, QTableWidgetItem())
            self.table.setCellWidget(row, 2, edit)
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        header.setSectionResizeMode(1, QHeaderView.ResizeMode.ResizeToContents)
        header.resizeSection(2, 170)
        self.problem = QLabel()
        self.problem.setWordWrap(True)
        self.reset_button = QPushButton("Back to the usual keys")
        self.reset_button.clicked.connect(self._on_reset)
        layout = QVBoxLayout(self)
        layout.addWidget(self.table, 1)
        layout.addWidget(self.problem)
        layout.addWidget(self.reset_button, 0, Qt.AlignmentFlag.AlignLeft)
        self._show()

    def _on_edited(self, name: str) -> None:
        sequence = self.edits[name].keySequence()
        if sequence.isEmpty():
            return
        self._say(self._keymap.change(name, sequence))
        self.edits[name].clear()
        self._show()

    def _on_reset(self) -> None:
        self._keymap.reset()
        self._say("")
        self._show()

    def _say(self, problem: str) -> None:
        self.problem.setStyleSheet(f"color: {css(current_theme().bad)};")
        self.problem.setText(problem)

    def _show(self) -> None:
        form = QKeySequence.SequenceFormat.NativeText
        for row, name in enumerate(self._keymap.names):
            keys = ", ".join(key.toString(form) for key in self._keymap.keys_of(name))
            item = self.table.item(row, 1)
            if item is not None:
                item.setText(keys)
