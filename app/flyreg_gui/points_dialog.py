"""Asks for points by which a registration is to be measured."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QLabel, QVBoxLayout, QWidget

from flyreg_core.errors import FlyregError
from flyreg_core.point_files import PointPairs, read_point_pairs_um
from flyreg_core.project import Project
from flyreg_gui.failures import sentence_for
from flyreg_gui.points_chooser import PointsChooser
from flyreg_gui.preferences import Preferences
from flyreg_gui.theme import css, current_theme

TEXT = (
    "Points of the source and where they belong in the target: a table with the columns x, y, z, "
    "x_target, y_target and z_target, or a landmark file with both ends. They should be other "
    "places than the landmarks; the page tells how far from there they land."
)


class PointsDialog(QDialog):
    """Stays open until there are points that can be read."""

    def __init__(self, project: Project, preferences: Preferences, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("Save report, measured on points")
        self._project = project
        self.truth: PointPairs | None = None
        self.chooser = PointsChooser(preferences, self)
        self.chooser.name.setPlaceholderText("a file of corresponding points")
        text = QLabel(TEXT)
        text.setWordWrap(True)
        self.problem = QLabel()
        self.problem.setWordWrap(True)
        self.problem.setTextFormat(Qt.TextFormat.PlainText)
        self.problem.setStyleSheet(f"color: {css(current_theme().bad)};")
        self.problem.hide()
        choices = QDialogButtonBox.StandardButton
        buttons = QDialogButtonBox(choices.Ok | choices.Cancel)
        self.ok_button = buttons.button(choices.Ok)
        self.ok_button.setText("Save report…")
        buttons.accepted.connect(self._on_accepted)
        buttons.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        layout.addWidget(text)
        layout.addWidget(self.chooser)
        layout.addWidget(self.problem)
        layout.addWidget(buttons)
        self.chooser.name.textChanged.connect(self._on_edited)
        self._on_edited()
        self.setMinimumWidth(720)

    def _on_edited(self) -> None:
        self.ok_button.setEnabled(self.chooser.path is not None)

    def _on_accepted(self) -> None:
        path = self.chooser.path
        if path is None:
            return
        try:
            self.truth = read_point_pairs_um(path, self._project, self.chooser.unit)
        except (FlyregError, OSError) as error:
            self.problem.setText(sentence_for(error))
            self.problem.show()
            self.adjustSize()
        else:
            self.accept()
