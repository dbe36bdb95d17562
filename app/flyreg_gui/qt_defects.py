"""What is wrong in the versions of Qt's bindings that flyreg runs with, and how it lives with it."""

from __future__ import annotations

import ctypes
import sys

import PySide6

MANY = 2**40


def keep_true_alive() -> None:
    """Make up for references to True that PySide6 6.12.0 loses.

    Each `Signal.emit` drops one that it never took. Before Python 3.12, where True became
    immortal, the interpreter aborts when none is left: after some 600 signals.
    """
    if PySide6.__version_info__[:3] == (6, 12, 0) and sys.version_info < (3, 12):
        count = ctypes.c_ssize_t.from_address(id(True))
        if count.value < MANY:
            count.value += MANY
