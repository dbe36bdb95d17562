"""Offers, above the views, what a program that ended too early had not saved."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton

from flyreg_core.errors import FlyregError
from flyreg_gui.autosave import LeftOver, find_left_overs
from flyreg_gui.failures import sentence_for
from flyreg_gui.theme import Theme, css

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow


class RecoveryBar(QFrame):
    """One left-over after the other: recover it, discard it, or decide later."""

    def __init__(self, window: MainWindow) -> None:
        super().__init__()
        self.setObjectName("recovery")
        self._window = window
        self.left_overs: list[LeftOver] = []
        self._text = QLabel()
        self._text.setWordWrap(True)
        self._text.setTextFormat(Qt.TextFormat.PlainText)
        self.recover_button = QPushButton("Recover")
        self.discard_button = QPushButton("Discard")
        self.later_button = QPushButton("Later")
        self.later_button.setToolTip("Ask again at the next start")
        self.recover_button.clicked.connect(self._on_recover)
        self.discard_button.clicked.connect(self._on_discard)
        self.later_button.clicked.connect(self._on_later)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(10, 6, 6, 6)
        layout.addWidget(self._text, 1)
        for button in (self.recover_button, self.discard_button, self.later_button):
            layout.addWidget(button)
        self.hide()

    @property
    def text(self) -> str:
        """What is on show; empty if nothing is."""
        return "" if self.isHidden() else self._text.text()

    def look(self) -> None:
        """Offer what there is."""
        self.release()
        self.left_overs = find_left_overs()
        self._show()

    def release(self) -> None:
        """Leave what was not decided for the next start."""
        for left in self.left_overs:
            left.keep()
        self.left_overs = []
        self.hide()

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        ground = "#1d3346" if theme.is_dark else "#e4f0fa"
        self.setStyleSheet(
            f"#recovery {{ background: {ground}; border-bottom: 1px solid {css(theme.busy)}; }}"
            f"#recovery QLabel {{ color: {css(theme.text)}; }}"
        )

    def _on_recover(self) -> None:
        left, window = self.left_overs[0], self._window
        try:
            project = left.load()
        except (FlyregError, OSError) as error:
            window.show_problem(sentence_for(error))
            return
        if not window.files.may_discard():
            return
        window.show_problem("")
        window.session.open(project, left.project_path, is_recovered=True)
        if window.autosave.save_now():
            left.discard()
        else:
            left.keep()
        self._next()

    def _on_discard(self) -> None:
        self.left_overs[0].discard()
        self._next()

    def _on_later(self) -> None:
        self.left_overs[0].keep()
        self._next()

    def _next(self) -> None:
        self.left_overs = self.left_overs[1:]
        self._show()

    def _show(self) -> None:
        if self.left_overs:
            others = len(self.left_overs) - 1
            more = f" ({others} more after this)" if others else ""
            self._text.setText(f"flyreg ended early. {self.left_overs[0].sentence}{more}")
        self.setVisible(bool(self.left_overs))
