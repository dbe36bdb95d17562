"""Which landmarks are selected: one answer for all views, the table and the sliders."""

from __future__ import annotations

from collections.abc import Iterable

from PySide6.QtCore import QObject, Signal


class Selection(QObject):
    """The ids of the selected landmark pairs, in the order in which they were selected."""

    changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._ids: tuple[str, ...] = ()

    @property
    def ids(self) -> tuple[str, ...]:
        """The selected ids; the last is the current one."""
        return self._ids

    @property
    def current(self) -> str | None:
        """The id that was selected last."""
        return self._ids[-1] if self._ids else None

    def select(self, ids: Iterable[str]) -> None:
        """Select these and no others."""
        chosen = tuple(dict.fromkeys(ids))
        if chosen != self._ids:
            self._ids = chosen
            self.changed.emit()

    def toggle(self, identifier: str) -> None:
        """Add one to the selection, or take it out if it is there."""
        if identifier in self._ids:
            self.select(other for other in self._ids if other != identifier)
        else:
            self.select((*self._ids, identifier))

    def clear(self) -> None:
        """Select nothing."""
        self.select(())

    def keep(self, ids: Iterable[str]) -> None:
        """Drop from the selection what is not among `ids`."""
        existing = set(ids)
        self.select(identifier for identifier in self._ids if identifier in existing)
