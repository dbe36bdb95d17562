"""Memory that is free within the program goes back to the system."""

from __future__ import annotations

import ctypes
import sys


def give_back() -> None:
    """Return free memory to the system, where the C library keeps it otherwise (Linux).

    Each registration allocates and frees arrays of many sizes; what lies free between those that
    stay adds up to a third of what the program holds, and grows by chance.
    """
    if sys.platform.startswith("linux"):
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # other C libraries have none
        if trim is not None:
            trim(ctypes.c_size_t(0))
