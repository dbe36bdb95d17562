"""What the window shows before anything is open."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QPointF, Qt, Signal
from PySide6.QtGui import QColor, QIcon, QPainter, QPixmap
from PySide6.QtWidgets import (
    QCommandLinkButton,
    QGridLayout,
    QLabel,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from flyreg_gui.preferences import RecentBrain

MOST_OF_A_KIND = 4
ARROW_SIZE, ARROW_COLOR = 40, (61, 127, 196)

WELCOME = (
    "Registers the surface of one fly brain to another. Open two brain meshes, the one that is "
    "moved and the one that stays, or look at a made-up pair first."
)


class StartPage(QWidget):
    """Four ways to begin, and what was open lately."""

    open_asked = Signal()
    project_asked = Signal()
    demo_asked = Signal()
    templates_asked = Signal()
    recent_asked = Signal(str)
    recent_pair_asked = Signal(object, object)  # RecentBrain, RecentBrain

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
        self.templates_button = _big_button(
            "Open templates…", "Choose among the brains of flybrains by their pictures"
        )
        self.project_button = _big_button("Open project…", "Go on where you saved")
        self.demo_button = _big_button("Try the demo", "A made-up pair of brains; no files needed")
        buttons = (
            self.open_button,
            self.templates_button,
            self.project_button,
            self.demo_button,
        )
        for button, signal in zip(
            buttons,
            (self.open_asked, self.templates_asked, self.project_asked, self.demo_asked),
            strict=True,
        ):
            button.clicked.connect(signal)
        self._recent = QVBoxLayout()
        column = QVBoxLayout()
        column.setSpacing(8)
        self.choices = QWidget()
        ways = QVBoxLayout(self.choices)
        ways.setContentsMargins(0, 0, 0, 0)
        for button in buttons:
            ways.addWidget(button)
        for widget in (title, welcome, self.choices):
            column.addWidget(widget)
        column.addLayout(self._recent)
        layout = QGridLayout(self)
        layout.addLayout(column, 1, 1)
        for edge in (0, 2):
            layout.setRowStretch(edge, 1)
            layout.setColumnStretch(edge, 1)
        layout.setColumnMinimumWidth(1, 420)

    def show_recent(
        self, paths: Sequence[Path], pairs: Sequence[tuple[RecentBrain, RecentBrain]]
    ) -> None:
        """Offer projects and pairs of brains that were open lately."""
        while (item := self._recent.takeAt(0)) is not None:
            widget = item.widget()
            if widget is not None:
                widget.deleteLater()
        if paths or pairs:
            self._recent.addWidget(QLabel("<b>Recent</b>"))
        for path in paths[:MOST_OF_A_KIND]:
            link = _link(path.name, str(path))
            link.clicked.connect(lambda _on, path=path: self.recent_asked.emit(str(path)))
            self._recent.addWidget(link, alignment=Qt.AlignmentFlag.AlignLeft)
        for source, target in pairs[:MOST_OF_A_KIND]:
            link = _link(
                f"{source.short_name} on {target.short_name}", f"{source.name}\n{target.name}"
            )
            link.clicked.connect(
                lambda _on, pair=(source, target): self.recent_pair_asked.emit(*pair)
            )
            self._recent.addWidget(link, alignment=Qt.AlignmentFlag.AlignLeft)


def _link(text: str, tip: str) -> QPushButton:
    button = QPushButton(text)
    button.setFlat(True)
    button.setToolTip(tip)
    button.setCursor(Qt.CursorShape.PointingHandCursor)
    return button


def _big_button(text: str, hint: str) -> QCommandLinkButton:
    button = QCommandLinkButton(text, hint)
    button.setMinimumHeight(56)
    button.setIcon(_arrow())  # the style's own is black, also on dark ground
    return button


def _arrow() -> QIcon:
    pixmap = QPixmap(ARROW_SIZE, ARROW_SIZE)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(*ARROW_COLOR))
    far, near = 0.75 * ARROW_SIZE, 0.3 * ARROW_SIZE
    painter.drawPolygon(
        [
            QPointF(near, near / 2),
            QPointF(far, ARROW_SIZE / 2),
            QPointF(near, ARROW_SIZE - near / 2),
        ]
    )
    painter.end()
    return QIcon(pixmap)
