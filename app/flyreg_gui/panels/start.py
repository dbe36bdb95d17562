"""What the window shows before anything is open."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QCommandLinkButton, QGridLayout, QLabel, QVBoxLayout, QWidget

WELCOME = (
    "Registers the surface of one fly brain to another. Open two brain meshes, the one that is "
    "moved and the one that stays, or look at a made-up pair first."
)


class StartPage(QWidget):
    """Three ways to begin, and the projects that were open lately."""

    open_asked = Signal()
    project_asked = Signal()
    demo_asked = Signal()
    recent_asked = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        title = QLabel("flyreg")
        font = title.font()
        font.setPointSizeF(2.4 * font.pointSizeF())
        font.setBold(True)
        title.setFont(font)
        welcome = QLabel(WELCOME)
        welcome.setWordWrap(True)
        self.open_button = _big_button(
            "Open brains…", "Meshes, point clouds, label volumes, or templates of flybrains"
        )
        self.project_button = _big_button("Open project…", "Go on where you saved")
        self.demo_button = _big_button("Try the demo", "A made-up pair of brains; no files needed")
        buttons = (self.open_button, self.project_button, self.demo_button)
        for button, signal in zip(
            buttons, (self.open_asked, self.project_asked, self.demo_asked), strict=True
        ):
            button.clicked.connect(signal)
        self._recent = QVBoxLayout()
        column = QVBoxLayout()
        column.setSpacing(8)
        for widget in (title, welcome, *buttons):
            column.addWidget(widget)
        column.addLayout(self._recent)
        layout = QGridLayout(self)
        layout.addLayout(column, 1, 1)
        for edge in (0, 2):
            layout.setRowStretch(edge, 1)
            layout.setColumnStretch(edge, 1)
        layout.setColumnMinimumWidth(1, 420)

    def show_recent(self, paths: Sequence[Path]) -> None:
        """Offer projects that were open lately."""
        while (item := self._recent.takeAt(0)) is not None:
            widget = item.widget()
            if widget is not None:
                widget.deleteLater()
        if paths:
            self._recent.addWidget(QLabel("<b>Recent projects</b>"))
        for path in paths[:5]:
            link = QLabel(f'<a href="{path}">{path.name}</a>')
            link.setToolTip(str(path))
            link.setTextInteractionFlags(Qt.TextInteractionFlag.LinksAccessibleByMouse)
            link.linkActivated.connect(self.recent_asked)
            self._recent.addWidget(link)


def _big_button(text: str, hint: str) -> QCommandLinkButton:
    button = QCommandLinkButton(text, hint)
    button.setMinimumHeight(56)
    return button
