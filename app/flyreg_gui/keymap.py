"""Which keys do what: the table's, unless the user chose others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from PySide6.QtGui import QAction, QKeySequence

from flyreg_gui.preferences import Preferences

FORM = QKeySequence.SequenceFormat.PortableText
NATIVE = QKeySequence.SequenceFormat.NativeText


class Keymap:
    """The keys of all actions; what is changed is remembered."""

    def __init__(self, actions: Mapping[str, QAction], preferences: Preferences) -> None:
        self._actions, self._preferences = actions, preferences
        self._usual = {name: list(action.shortcuts()) for name, action in actions.items()}
        for name, keys in preferences.keys.items():
            if name in actions:
                actions[name].setShortcuts([QKeySequence.fromString(key, FORM) for key in keys])
        self._show_keys()

    @property
    def names(self) -> Sequence[str]:
        """The names of all actions, in the order of the menus."""
        return list(self._actions)

    def text_of(self, name: str) -> str:
        """Return what an action is called, whatever it would do now."""
        return self._actions[name].iconText().replace("&", "").rstrip("…")

    def keys_of(self, name: str) -> Sequence[QKeySequence]:
        """Return the keys of an action."""
        return self._actions[name].shortcuts()

    def change(self, name: str, key: QKeySequence) -> str:
        """Give an action one key instead of those it has; say why, if that cannot be."""
        for other in self._actions:
            if other != name and key in self.keys_of(other):
                return (
                    f"{key.toString(NATIVE)} already means "
                    f"“{self.text_of(other)}”; choose another key, or change that one first."
                )
        self._actions[name].setShortcuts([key])
        self._remember()
        return ""

    def reset(self) -> None:
        """Give all actions their usual keys again."""
        for name, keys in self._usual.items():
            self._actions[name].setShortcuts(keys)
        self._remember()

    def _show_keys(self) -> None:
        """Say the keys where the mouse rests on a button."""
        for name, action in self._actions.items():
            keys = self.keys_of(name)
            tip = action.statusTip() or self.text_of(name)
            action.setToolTip(f"{tip} ({keys[0].toString(NATIVE)})" if keys else tip)

    def _remember(self) -> None:
        self._show_keys()
        self._preferences.keys = {
            name: [key.toString(FORM) for key in self.keys_of(name)]
            for name, usual in self._usual.items()
            if list(self.keys_of(name)) != usual
        }

    def as_markdown(self) -> str:
        """Return the keys as a table for the help."""
        lines = ["| Key | Does |", "|---|---|"]
        for name in self.names:
            keys = ", ".join(key.toString(NATIVE) for key in self.keys_of(name))
            if keys:
                tip = self._actions[name].statusTip()
                text = self.text_of(name) + (f": {tip}" if tip else "")
                lines.append(f"| {keys.replace('|', chr(92) + '|')} | {text} |")
        return "\n".join(lines)
