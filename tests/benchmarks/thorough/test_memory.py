"""What the window holds on to: memory after many edits, and after many projects, stays level."""

from __future__ import annotations

import gc
import os
from dataclasses import replace
from pathlib import Path

import pytest

from flyreg_core import edits
from flyreg_core.pipeline import Pipeline
from flyreg_core.project_file import load_project, save_project
from tests.app.conftest import *  # noqa: F403 - the window's fixtures

pytest.importorskip("PySide6")
from flyreg_gui.memory import keep_large_arrays_apart

from tests.app.hands import settle

os.environ.setdefault("LP_NUM_THREADS", "0")
"""Where no graphics card draws, Mesa's threads keep pictures that wait, by chance none or 60 MB of them:
drawing one scene again and again is enough. Without threads it keeps none; what is measured is the
program's own."""

LEVEL = 1.05
"""How much more than after the warm-up may be held at any time after it."""
WARM_UP_CYCLES, WARM_UP_PROJECTS = 40, 5
"""Until then graphics and allocator take what they keep: what is used, not freed, is level before."""
REST_MS = 1000
"""How long the hand rests before the memory is read: the window has drawn, and has given back."""
STATUS = Path("/proc/self/status")


@pytest.fixture(autouse=True)
def allocator():
    """Have memory allocated as the program sets it at its start."""
    keep_large_arrays_apart()


def resident_mb(qtbot) -> float:
    """Return the memory that this process keeps while the hand rests, in megabytes."""
    gc.collect()
    qtbot.wait(REST_MS)
    line = next(line for line in STATUS.read_text().splitlines() if line.startswith("VmRSS"))
    return int(line.split()[1]) / 1024


@pytest.mark.skipif(not STATUS.exists(), reason="the memory of a process is read as Linux tells it")
def test_200_cycles_of_registering_editing_and_undoing_leave_memory_level(qtbot, window):
    taken = []
    for cycle in range(200):
        project = window.session.project
        edited = edits.set_weight(project, "upper-02", 0.1 + cycle % 7)
        edited = edits.set_smoothing(edited, 1e-3 * (1 + cycle % 5))
        window.session.edit("change", edited)
        settle(qtbot, window)
        window.session.undo_stack.undo()
        settle(qtbot, window)
        if (cycle + 1) % WARM_UP_CYCLES == 0:
            taken.append(resident_mb(qtbot))
    print(f"\nMB after each {WARM_UP_CYCLES} cycles:", [round(value) for value in taken])
    assert max(taken) <= LEVEL * taken[0]


@pytest.mark.skipif(not STATUS.exists(), reason="the memory of a process is read as Linux tells it")
def test_20_projects_opened_and_left_leave_memory_level(qtbot, empty_window, project, tmp_path):
    paths = []
    for number in range(2):  # two that differ, so that each is prepared anew in part
        paths.append(tmp_path / f"{number}.flyreg")
        save_project(replace(project, smoothing=10.0 ** -(2 + number)), paths[-1])
    taken = []
    for cycle in range(20):
        empty_window.session.open(load_project(paths[cycle % 2]))
        settle(qtbot, empty_window)
        if (cycle + 1) % WARM_UP_PROJECTS == 0:
            taken.append(resident_mb(qtbot))
    print(f"\nMB after each {WARM_UP_PROJECTS} projects:", [round(value) for value in taken])
    assert max(taken) <= LEVEL * taken[0]


@pytest.fixture(scope="session")
def pipeline():
    """A pipeline that remembers what any would."""
    return Pipeline()
