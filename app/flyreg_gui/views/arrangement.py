"""Which views share the window, and how: each can be hidden, maximised, made larger or smaller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QSplitter, QVBoxLayout, QWidget

from flyreg_gui.views.view_frame import ViewFrame

FIRST_ROW = 3
"""As many views are in space; the others are flat."""


@dataclass(frozen=True)
class Layout:
    """One of the ready-made arrangements."""

    name: str
    title: str
    shown: tuple[int, ...]  # numbers of the views
    is_beside: bool = False  # brains beside the flat halves, not above them


LAYOUTS = (
    Layout("above", "Brains &above the flat halves", (0, 1, 2, 3, 4)),
    Layout("beside", "Brains &beside the flat halves", (0, 1, 2, 3, 4), is_beside=True),
    Layout("brains", "Brains &only", (0, 1, 2)),
    Layout("flat", "&Flat halves only", (3, 4)),
    Layout("result", "&Registered brain and flat halves", (2, 3, 4), is_beside=True),
)


class Arrangement(QWidget):
    """The views in rows or columns with movable borders; no view is ever made anew."""

    changed = Signal()  # which views are shown

    def __init__(self, frames: Sequence[ViewFrame]) -> None:
        super().__init__()
        self._frames = tuple(frames)
        self._shown = set(range(len(frames)))
        self._maximised: ViewFrame | None = None
        self._is_beside = False
        self._rows = (QSplitter(), QSplitter())
        self._both = QSplitter()
        for row, own in zip(self._rows, (frames[:FIRST_ROW], frames[FIRST_ROW:]), strict=True):
            for frame in own:
                row.addWidget(frame)
            self._both.addWidget(row)
        for splitter in self._splitters:
            splitter.setChildrenCollapsible(False)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 4)
        layout.addWidget(self._both)
        self.take(LAYOUTS[0])

    def take(self, layout: Layout) -> None:
        """Arrange the views in a ready-made way, of equal sizes."""
        self._shown, self._is_beside = set(layout.shown), layout.is_beside
        self._maximised = None
        self._show()
        for splitter in self._splitters:
            splitter.setSizes([1000] * splitter.count())

    def is_shown(self, number: int) -> bool:
        """Tell whether a view has room when none is maximised."""
        return number in self._shown

    def set_shown(self, number: int, shown: bool) -> None:
        """Show or hide a view; the last one stays."""
        changed = self._shown | {number} if shown else self._shown - {number}
        if changed:
            self._shown, self._maximised = changed, None
        self._show()

    def toggle_maximised(self, frame: ViewFrame) -> None:
        """Give the whole area to one view, or share it again."""
        self._maximised = None if self._maximised is frame else frame
        self._show()

    def state(self) -> dict[str, object]:
        """Return what restores the arrangement, as JSON knows it."""
        return {
            "shown": sorted(self._shown),
            "is_beside": self._is_beside,
            "sizes": [splitter.sizes() for splitter in self._splitters],
        }

    def restore(self, state: object) -> None:
        """Arrange the views as a state says; what is missing or damaged stays as it is."""
        if not isinstance(state, Mapping):
            return
        shown, sizes = _numbers(state.get("shown")), state.get("sizes")
        known = {number for number in shown or () if number < len(self._frames)}
        if known:
            self._shown, self._maximised = known, None
        if isinstance(state.get("is_beside"), bool):
            self._is_beside = bool(state["is_beside"])
        self._show()
        if isinstance(sizes, Sequence) and len(sizes) == len(self._splitters):
            for splitter, own in zip(self._splitters, sizes, strict=True):
                numbers = _numbers(own)
                if numbers is not None and len(numbers) == splitter.count() and any(numbers):
                    splitter.setSizes(numbers)

    @property
    def _splitters(self) -> tuple[QSplitter, ...]:
        return (self._both, *self._rows)

    def _show(self) -> None:
        across, down = Qt.Orientation.Horizontal, Qt.Orientation.Vertical
        self._both.setOrientation(across if self._is_beside else down)
        for row in self._rows:
            row.setOrientation(down if self._is_beside else across)
        shown = {self._frames[number] for number in self._shown}
        if self._maximised is not None:
            shown = {self._maximised}
        for frame in self._frames:
            frame.setVisible(frame in shown)
        for row in self._rows:
            row.setVisible(any(row.indexOf(frame) >= 0 for frame in shown))
        self.changed.emit()


def _numbers(value: object) -> list[int] | None:
    """Return a list of whole numbers, none negative, or None if it is something else."""
    if not isinstance(value, Sequence) or isinstance(value, str):
        return None
    if not all(isinstance(number, int) and number >= 0 for number in value):
        return None
    return list(value)
