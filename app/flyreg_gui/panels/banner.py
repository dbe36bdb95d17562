"""A message above the views that waits until it is read and stops nobody."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QToolButton

from flyreg_gui.failures import as_sentence
from flyreg_gui.theme import Theme, css


class Banner(QFrame):
    """One sentence, perhaps a button that helps, and one that takes it away."""

    asked = Signal()  # the user wants the help that was offered

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("banner")
        self._text = QLabel()
        self._text.setWordWrap(True)
        self._text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._text.setTextFormat(Qt.TextFormat.PlainText)
        self.help_button = QPushButton("Help")
        self.help_button.clicked.connect(self.asked)
        self.close_button = QToolButton()
        self.close_button.setText("✕")
        self.close_button.setAutoRaise(True)
        self.close_button.setToolTip("Dismiss")
        self.close_button.clicked.connect(self.hide)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(10, 6, 6, 6)
        layout.addWidget(self._text, 1)
        layout.addWidget(self.help_button, 0, Qt.AlignmentFlag.AlignTop)
        layout.addWidget(self.close_button, 0, Qt.AlignmentFlag.AlignTop)
        self.hide()

    @property
    def text(self) -> str:
        """What is on show; empty if nothing is."""
        return "" if self.isHidden() else self._text.text()

    def show_sentence(self, sentence: str, offer: str = "") -> None:
        """Show a sentence and offer help by a button; an empty one takes the banner away."""
        self.help_button.setText(offer)
        self.help_button.setVisible(bool(offer))
        self._text.setText(as_sentence(sentence))
        self.setVisible(bool(sentence))

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        ground = "#4a2a20" if theme.is_dark else "#fdebe3"
        self.setStyleSheet(
            f"#banner {{ background: {ground}; border-bottom: 1px solid {css(theme.bad)}; }}"
            f"#banner QLabel {{ color: {css(theme.text)}; }}"
        )
