"""What the window needed for a registration goes back to the system when the hand rests."""

from __future__ import annotations

import sys

import numpy as np
import psutil
import pytest

pytest.importorskip("PySide6")
from flyreg_gui.memory import keep_large_arrays_apart

from flyreg_core import edits
from tests.app.hands import settle

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]

COUNT, LENGTH = 200, 110_000
"""Arrays that take 880 kB each, so that they live in the heap, 176 MB of them."""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux can be asked for it")
def test_memory_that_is_free_in_the_heap_is_given_back_once_results_are_on_show(qtbot, window):
    keep_large_arrays_apart()
    arrays = [np.ones(LENGTH) for _ in range(COUNT)]
    arrays = arrays[-1:]  # which keeps the heap from getting shorter by itself
    before = psutil.Process().memory_info().rss
    project = window.session.project
    window.session.edit("change", edits.set_weight(project, "upper-02", 3.0))
    settle(qtbot, window)
    lower = before - COUNT * arrays[0].nbytes / 2
    qtbot.waitUntil(lambda: psutil.Process().memory_info().rss < lower)
