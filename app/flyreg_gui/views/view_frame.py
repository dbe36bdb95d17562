"""A canvas with its title; a double click on the title gives it the whole area."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QSizePolicy, QToolButton, QVBoxLayout

from flyreg_gui.theme import Color, css
from flyreg_gui.views.canvas import Canvas


class TitleBar(QFrame):
    """The strip above a canvas: a colour key, the title, what is on show, the maximise button."""

    double_clicked = Signal()

    def __init__(self, title: str, color: Color | None) -> None:
        super().__init__()
        self._title, self._detail = QLabel(f"<b>{title}</b>"), QLabel()
        self._detail.setEnabled(False)
        self._detail.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.button = QToolButton()
        self.button.setText("⤢")
        self.button.setAutoRaise(True)
        self.button.setToolTip("Maximise or restore this view (or double-click the title)")
        self.button.setAccessibleName(f"Maximise {title}")
        layout = QHBoxLayout(self)
        layout.setContentsMargins(8, 2, 2, 2)
        layout.setSpacing(6)
        if color is not None:
            key = QFrame()
            key.setFixedSize(11, 11)
            key.setStyleSheet(f"background: {css(color)}; border-radius: 2px;")
            layout.addWidget(key)
        layout.addWidget(self._title)
        layout.addWidget(self._detail, 1)
        layout.addWidget(self.button)
        self.button.clicked.connect(self.double_clicked)

    def set_detail(self, text: str) -> None:
        """Say what is on show, beside the title; cut off where there is no room."""
        self._detail.setText(text)
        self._detail.setToolTip(text)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Ask for the whole area."""
        self.double_clicked.emit()
        event.accept()


class ViewFrame(QFrame):
    """A titled canvas. Before there is something to draw, a note says what will be there."""

    maximise_asked = Signal()

    def __init__(
        self, title: str, note: str, color: Color | None, canvas_type: type[Canvas]
    ) -> None:
        super().__init__()
        self.setFrameShape(QFrame.Shape.StyledPanel)
        self.title = TitleBar(title, color)
        self.canvas = canvas_type(self)
        self.canvas.setAccessibleName(title)
        self._note = QLabel(note, self)
        self._note.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._note.setWordWrap(True)
        self._note.setEnabled(False)
        self._note.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.title)
        layout.addWidget(self.canvas, 1)
        self.title.double_clicked.connect(self.maximise_asked)
        self.canvas.resized.connect(self._place_note)

    def set_empty(self, empty: bool) -> None:
        """Show or hide the note."""
        self._note.setVisible(empty)

    def set_note(self, note: str) -> None:
        """Say something else while the view is empty."""
        self._note.setText(note)

    def _place_note(self) -> None:
        self._note.setGeometry(self.canvas.geometry().adjusted(12, 12, -12, -12))
        self._note.raise_()
