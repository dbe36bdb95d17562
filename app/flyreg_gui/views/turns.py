"""Scenes that are slow to draw take turns, so that the window answers the hand in between."""

from __future__ import annotations

from typing import Protocol

from PySide6.QtCore import QObject, QTimer, Signal

LATE_MS = 500
"""So long one waits for the one before it, which Qt may never draw if nothing of it is in sight."""


class Drawn(Protocol):
    """What is drawn when its turn has come: a canvas."""

    def update(self) -> None:
        """Have Qt draw it."""

    def isVisible(self) -> bool:
        """Tell whether Qt would."""


class Turns(QObject):
    """Lets one of those that wait be drawn, then the window answer what came, then the next."""

    over = Signal()  # none waits any more

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._waiting: list[Drawn] = []
        self._drawing: Drawn | None = None
        self._next = QTimer(self)
        self._next.setSingleShot(True)
        self._next.timeout.connect(self._on_next)

    def ask(self, one: Drawn) -> None:
        """Have it drawn once those who asked before have been."""
        if one not in self._waiting:
            self._waiting.append(one)
        self.go_on()

    def go_on(self) -> None:
        """Have the next one drawn, or tell that none waits, once the window has answered what came."""
        if self._drawing is None or not self._drawing.isVisible():
            self._next.start(0)

    def drawn(self, one: Drawn) -> None:
        """Take notice that one has been drawn, in its turn or not."""
        if one in self._waiting:
            self._waiting.remove(one)
        if one is self._drawing:
            self._drawing = None
        self.go_on()

    def _on_next(self) -> None:
        self._drawing = None
        while self._waiting and self._drawing is None:
            one = self._waiting.pop(0)
            if one.isVisible():
                self._drawing = one
                one.update()
        if self._drawing is None:
            self.over.emit()
        else:
            self._next.start(LATE_MS)
