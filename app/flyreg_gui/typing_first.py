"""Keys mean what they mean to the choice or button that has the keyboard, before any shortcut."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QAbstractButton, QComboBox, QWidget

PLAIN = (Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ShiftModifier)


class TypingFirst(QObject):
    """Takes letters for what has the keyboard, before the window's shortcuts get them.

    Letters and digits choose in a drop-down choice, and Space presses a button. Fields to type in
    see to it themselves. Tables and lists take none: after a click on a landmark its keys are meant.
    """

    def __init__(self, window: QWidget) -> None:
        super().__init__(window)
        for kind in (QComboBox, QAbstractButton):
            for widget in window.findChildren(kind):
                widget.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Accept the question whether a key is meant for the widget."""
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            is_space = event.key() == Qt.Key.Key_Space
            is_typed = event.modifiers() in PLAIN and event.text().isalnum()
            if is_space if isinstance(watched, QAbstractButton) else is_typed:
                event.accept()
                return True
        return False
