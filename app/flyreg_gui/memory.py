"""Memory that is no longer used goes back to the system (Linux, where the C library can be asked).

Each registration allocates and frees arrays of many sizes. Left to itself glibc keeps what is freed,
and what lies free between arrays that stay grows by chance to as much as they hold.
"""

from __future__ import annotations

import ctypes
import sys
from typing import Any

M_MMAP_THRESHOLD = -3
LARGE_BYTES = 1 << 20
"""Arrays of a megabyte and more go back to the system as soon as they are freed."""


def keep_large_arrays_apart() -> None:
    """Have large arrays live outside the heap, for as long as the program runs.

    glibc begins so, but takes larger and larger arrays into the heap unless it is told a limit.
    """
    if (set_option := _function("mallopt")) is not None:
        set_option(ctypes.c_int(M_MMAP_THRESHOLD), ctypes.c_int(LARGE_BYTES))


def give_back() -> None:
    """Return what lies free in the heap now; takes some milliseconds."""
    if (trim := _function("malloc_trim")) is not None:
        trim(ctypes.c_size_t(0))


def _function(name: str) -> Any:
    """Return a function of the C library; None where it has none of that name."""
    return getattr(ctypes.CDLL(None), name, None) if sys.platform.startswith("linux") else None
