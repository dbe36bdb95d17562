"""A row that names a file of corresponding points, and their unit."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtWidgets import (
    QComboBox,
    QFileDialog,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QWidget,
)

from flyreg_core.project import Unit
from flyreg_gui.preferences import Preferences

TIP = (
    "A table with the columns x, y, z of the source and x_target, y_target, z_target of where the "
    "points belong, or a landmark file with both ends; the target registration error is measured "
    "on them"
)
POINT_PAIRS_FILTER = "Points and landmarks (*.csv *.json *.fcsv);;All files (*)"
UNITS: tuple[tuple[str, Unit | None], ...] = (
    ("in the units of the brains", None),
    ("in µm", "um"),
    ("in nm", "nm"),
    ("in mm", "mm"),
)


class PointsChooser(QWidget):
    """The file and the unit; no file is allowed."""

    def __init__(self, preferences: Preferences, parent: QWidget) -> None:
        super().__init__(parent)
        self._preferences = preferences
        self.name = QLineEdit()
        self.name.setPlaceholderText("none: the target registration error is not measured")
        self.name.setAccessibleName("File of corresponding points")
        self.name.setClearButtonEnabled(True)
        self.name.setToolTip(TIP)
        self.browse = QPushButton("Browse…")
        self.units = QComboBox()
        self.units.addItems([text for text, _ in UNITS])
        self.units.setAccessibleName("Unit of the points")
        label = QLabel("Corresponding points")
        label.setToolTip(TIP)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(label)
        layout.addWidget(self.name, 1)
        layout.addWidget(self.browse)
        layout.addWidget(self.units)
        self.browse.clicked.connect(self._on_browse)

    @property
    def path(self) -> Path | None:
        """The file, if one is named."""
        text = self.name.text().strip()
        return Path(text).expanduser() if text else None

    @property
    def unit(self) -> Unit | None:
        """The unit of the points; None: that of the brains' files."""
        return UNITS[self.units.currentIndex()][1]

    def _on_browse(self) -> None:
        folder = self._preferences.folder
        path, _ = QFileDialog.getOpenFileName(
            self, "Corresponding points", folder, POINT_PAIRS_FILTER
        )
        if path:
            self._preferences.folder = str(Path(path).parent)
            self.name.setText(path)
