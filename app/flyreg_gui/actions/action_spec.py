"""One action of the window: text, keys, menu, and what it does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow


@dataclass(frozen=True)
class ActionSpec:
    """One line of the table."""

    name: str
    menu: str
    text: str
    keys: tuple[str, ...]
    do: Callable[[MainWindow], object] | Callable[[MainWindow, bool], object]
    tip: str = ""
    is_on: bool | None = None  # None: not a switch
    needs: str = ""  # one of `needs_met`, without which it is grey
    short: str = (
        ""  # what it is called outside its menu, if the text there needs its menu or changes
    )
