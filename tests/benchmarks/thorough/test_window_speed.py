"""What the window costs: a tick on show, how long it ever stands still, and its start."""

from __future__ import annotations

import math
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flyreg_core.brain_files import open_brain
from flyreg_core.cache import open_cache
from flyreg_core.pipeline import Pipeline
from flyreg_core.project import Brain, Project
from flyreg_core.project_file import save_project
from flyreg_core.solid import SolidParameters
from tests.app.conftest import *  # noqa: F403 - the window's fixtures
from tests.benchmarks.thorough.test_live import FINE, milliseconds, with_landmarks

pytest.importorskip("PySide6")
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication

from tests.app.hands import settle

SECONDS = 10.0
BETWEEN_MOVES_MS = 16
"""A mouse tells the window of its place sixty times a second."""
TO_BE_DRAWN_MS = 3000
STARTED = """
import sys, time
started = time.time() - float(sys.argv[1])
from PySide6.QtWidgets import QApplication
from flyreg_gui.application import Pipeline, open_cache, MainWindow
from flyreg_core.project_file import load_project
from pathlib import Path
application = QApplication([])
window = MainWindow(Pipeline(open_cache()))
window.show()
application.processEvents()
print(time.time() - float(sys.argv[1]))
if len(sys.argv) > 2:
    window.session.open(load_project(Path(sys.argv[2])), Path(sys.argv[2]))
    while not window.session.is_up_to_date:
        application.processEvents()
        time.sleep(0.005)
    print(time.time() - float(sys.argv[1]))
sys.stdout.flush()
import os
os._exit(0)
"""


@pytest.fixture(scope="module")
def fine() -> tuple[Pipeline, Project]:
    """FCWB on JFRC2 at 100,000 vertices with 1,000 landmarks, and the pipeline that knows them."""
    pipeline = Pipeline(open_cache())
    brain = Brain(open_brain("FCWB"), solid=SolidParameters(FINE))
    results = pipeline.run(Project(brain, Brain(open_brain("JFRC2"))), measure=False)
    return pipeline, with_landmarks(results, 1000)


@pytest.fixture
def pipeline(fine):
    """The window's pipeline."""
    return fine[0]


@contextmanager
def heartbeat(gaps: list[float]) -> Iterator[None]:
    """Note how long the event loop takes from each beat to the next, milliseconds."""
    last = time.perf_counter()

    def beat() -> None:
        nonlocal last
        now = time.perf_counter()
        gaps.append(1e3 * (now - last))
        last = now

    timer = QTimer()
    timer.setInterval(1)
    timer.timeout.connect(beat)
    timer.start()
    yield
    timer.stop()


def test_a_tick_in_the_window_and_its_longest_stalls(qtbot, empty_window, fine, capsys):
    window, session = empty_window, empty_window.session
    session.open(fine[1])
    settle(qtbot, window)
    views = window.view_area.views
    slider = window.landmarks.smoothing_slider

    def redraw(_tick: int) -> None:
        for view in views:
            if view.canvas.isVisible():
                view.canvas.render()

    def tick(number: int) -> None:
        slider.setValue(150 + 3 * number)
        while not session.is_up_to_date:
            QApplication.processEvents()
        QApplication.processEvents()

    def relabel(number: int) -> None:
        window.status.show_place(str(number))
        QApplication.processEvents()

    label = milliseconds(relabel)
    drawing = milliseconds(redraw)
    session.begin_gesture()
    ticks = milliseconds(tick)
    session.end_gesture()
    settle(qtbot, window)

    rows = {"a label alone": label, "redrawing what stands": drawing, "a tick of lambda": ticks}
    rows["between beats, dragging"] = gaps_dragging(qtbot, window)
    for frame in window.view_area.frames:
        frame.hide()
    rows["the same, all views hidden"] = gaps_dragging(qtbot, window)
    for frame in window.view_area.frames:
        frame.show()
    qtbot.wait(TO_BE_DRAWN_MS)

    preparing: list[float] = []
    count = 0

    def note(*_news: object) -> None:
        nonlocal count
        count = count or len(preparing)

    session.results_changed.connect(note)
    source = fine[1].source
    other = replace(source, solid=replace(source.solid, voxels_across=FINE - 7))
    with heartbeat(preparing):
        session.edit("resolution", replace(fine[1], source=other))
        settle(qtbot, window)
    rows["between beats, preparing"] = preparing[:count]
    rows["showing what was prepared"] = preparing[count:]
    with capsys.disabled():
        print("\n| in the window, ms | median | 95th percentile | longest |\n|---|---|---|---|")
        for name, taken in rows.items():
            middle, high, most = np.percentile(taken, [50, 95, 100])
            print(f"| {name} | {middle:.1f} | {high:.1f} | {most:.1f} |")


def gaps_dragging(qtbot, window) -> list[float]:
    """Return how long the event loop takes from beat to beat while lambda is dragged, milliseconds."""
    gaps: list[float] = []
    slider = window.landmarks.smoothing_slider
    window.session.begin_gesture()
    with heartbeat(gaps):
        begun = time.perf_counter()
        while (now := time.perf_counter() - begun) < SECONDS:
            slider.setValue(round(200 + 100 * math.sin(2 * now)))
            qtbot.wait(BETWEEN_MOVES_MS)
    window.session.end_gesture()
    settle(qtbot, window)
    return gaps


def test_the_window_opens_and_a_project_again(qapp, tmp_path: Path, capsys, monkeypatch) -> None:
    path = tmp_path / "a.flyreg"
    monkeypatch.setenv("FLYREG_CACHE", str(tmp_path / "cache"))
    project = Project(Brain(open_brain("FCWB")), Brain(open_brain("JFRC2")))
    Pipeline(open_cache()).run(project, measure=False)
    save_project(project, path)
    shown, opened = [], []
    for _ in range(5):
        command = [sys.executable, "-c", STARTED, str(time.time()), str(path)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        first, second = done.stdout.split()
        shown.append(float(first))
        opened.append(float(second) - float(first))
    with capsys.disabled():
        print(f"\nwindow visible: {np.median(shown):.2f} s")
        print(f"project opened again: {np.median(opened):.2f} s")
