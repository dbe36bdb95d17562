"""The modes that change what a click means: at most one is on, and one hint tells how it goes on."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from PySide6.QtCore import QObject
from PySide6.QtGui import QAction

from flyreg_gui.drill_mode import DrillMode
from flyreg_gui.landmark_mode import LandmarkMode
from flyreg_gui.status import StatusBar
from flyreg_gui.trim_mode import TrimMode

Mode = LandmarkMode | DrillMode | TrimMode


class Modes(QObject):
    """Keeps modes, their actions and the hint in the status bar together."""

    def __init__(
        self,
        modes: Mapping[str, Mode],
        actions: Mapping[str, QAction],
        status: StatusBar,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._modes, self._actions, self._status = modes, actions, status
        for name, mode in modes.items():
            mode.changed.connect(partial(self._on_changed, name))
        modes["trim"].dragged.connect(self._show_hint)  # type: ignore[union-attr]

    def abandon(self) -> bool:
        """End what is half made, or else a mode that Esc ends; tell whether there was anything."""
        return any(mode.abandon() for mode in self._modes.values())

    def _on_changed(self, name: str) -> None:
        if self._modes[name].is_on:
            for other, mode in self._modes.items():
                if other != name:
                    mode.set_on(False)
        self._actions[name].setChecked(self._modes[name].is_on)
        self._show_hint()

    def _show_hint(self, *_news: object) -> None:
        self._status.show_hint("".join(mode.next_step for mode in self._modes.values()))
