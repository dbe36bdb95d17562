"""What a tick under the hand costs: as a share of solving anew, and whole, at 100,000 vertices."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator

from flyreg_core import edits
from flyreg_core.brain_files import open_brain
from flyreg_core.cache import open_cache
from flyreg_core.landmarks import LandmarkPair
from flyreg_core.live_spline import LiveSpline
from flyreg_core.pipeline import Pipeline
from flyreg_core.progress import ignore
from flyreg_core.project import Brain, Project
from flyreg_core.results import Results
from flyreg_core.solid import SolidParameters

EQUAL = 1e-6
POINTS, LANDMARKS = 100_000, 1000
TICKS = 40
FINE = 68
"""Voxels across a brain that give its surface about 100,000 vertices."""


def milliseconds(work: Callable[[int], object], ticks: int = TICKS) -> np.ndarray:
    """Return how long each of several calls took, after three that do not count."""
    taken = []
    for tick in range(ticks + 3):
        start = time.perf_counter()
        work(tick)
        taken.append(time.perf_counter() - start)
    return 1e3 * np.array(taken[3:])


def test_a_tick_is_a_small_share_of_solving_anew(capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 1, (POINTS, 2))
    sources = rng.uniform(-1, 1, (LANDMARKS, 2))
    targets = sources + rng.normal(0, 0.02, sources.shape)
    smoothing = 1e-2
    started = time.perf_counter()
    anew = RBFInterpolator(sources, targets, kernel="thin_plate_spline", smoothing=smoothing)
    expected = anew(points)
    seconds = time.perf_counter() - started
    live = LiveSpline(points, most_bytes=2**30)
    weights = np.ones(LANDMARKS)

    def ask(weights: np.ndarray, targets: np.ndarray, smoothing: float) -> np.ndarray:
        return live(sources, targets, weights, smoothing, ignore)

    def weigh(tick: int) -> None:
        changed = weights.copy()
        changed[17] = 0.1 + tick
        ask(changed, targets, smoothing)

    def move(tick: int) -> None:
        moved = targets.copy()
        moved[17] += 1e-3 * tick
        ask(weights, moved, smoothing)

    def bend(tick: int) -> None:
        ask(weights, targets, 1e-6 * 10 ** (7 * (tick + 1) / (TICKS + 4)))

    # scipy's kernel is r^2 log r, half of r^2 log r^2: half its smoothing is the same spline
    away = np.abs(ask(weights, targets, 2 * smoothing) - expected).max()
    rows = [("one weight", milliseconds(weigh)), ("one target", milliseconds(move))]
    rows.append(("lambda, over seven decades", milliseconds(bend)))
    with capsys.disabled():
        print(f"\nscipy, fit and evaluate: {seconds:.2f} s; greatest difference {away:.1e}")
        print("| tick | median, ms | 95th percentile, ms | times faster |\n|---|---|---|---|")
        for name, taken in rows:
            middle, high = np.percentile(taken, [50, 95])
            print(f"| {name} | {middle:.2f} | {high:.2f} | {1e3 * seconds / middle:,.0f} |")
    assert away < EQUAL


@pytest.fixture(scope="module")
def pair() -> tuple[Pipeline, Results]:
    """The pipeline and FCWB on JFRC2, the source finely cut."""
    fine = Brain(open_brain("FCWB"), solid=SolidParameters(FINE))
    pipeline = Pipeline(open_cache())
    return pipeline, pipeline.run(Project(fine, Brain(open_brain("JFRC2"))), measure=False)


def with_landmarks(results: Results, count: int) -> Project:
    """Return the project with as many landmarks of the user's own as make `count` in all."""
    rng = np.random.default_rng(1)
    before, after = results.source.surface.vertices, results.registration.surface.vertices
    inner = np.concatenate([half.vertex_of for half in results.source.halves.values()])
    chosen = rng.choice(inner, max(count - len(results.landmarks), 1), replace=False)
    ends = after[chosen] + rng.normal(0, 0.5, (len(chosen), 3))
    pairs = tuple(
        LandmarkPair(f"own-{k}", f"own {k}", "interior", None, tuple(start), tuple(end))
        for k, (start, end) in enumerate(zip(before[chosen].tolist(), ends.tolist(), strict=True))
    )
    return replace(results.project, pairs=pairs)


@pytest.mark.parametrize("count", [150, 1000, 4000])
def test_a_whole_tick(
    pair: tuple[Pipeline, Results], count: int, capsys: pytest.CaptureFixture[str]
) -> None:
    pipeline, results = pair
    project = with_landmarks(results, count)
    pipeline.run(project, measure=False)
    end = np.array(project.pairs[0].target)
    works: dict[str, Callable[[int], Project]] = {
        "one weight": lambda tick: edits.set_weight(project, "own-0", 0.1 + tick),
        "one weight on a seam": lambda tick: edits.set_weight(project, "upper-04", 0.1 + tick),
        "one target": lambda tick: edits.place_pair(
            project, "own-0", "target", tuple((end + np.array([0.1 * tick, 0, 0])).tolist())
        ),
        "lambda": lambda tick: edits.set_smoothing(project, 0.011 * 1.05**tick),
    }
    vertices = len(results.source.surface.vertices)
    with capsys.disabled():
        print(f"\n{vertices:,} vertices, {count} landmarks, a whole tick in ms:")
        print("| tick | median | 95th percentile |\n|---|---|---|")
        for name, change in works.items():
            taken = milliseconds(lambda tick, to=change: pipeline.run(to(tick), measure=False))
            middle, high = np.percentile(taken, [50, 95])
            print(f"| {name} | {middle:.1f} | {high:.1f} |")


def test_programs_start_at_once(capsys: pytest.CaptureFixture[str]) -> None:
    commands = {"flyreg --help": ["flyreg_core.cli", "--help"]}
    with capsys.disabled():
        for name, command in commands.items():
            taken = milliseconds(
                lambda tick, command=command: subprocess.run(
                    [sys.executable, "-m", *command], capture_output=True, check=True
                ),
                ticks=5,
            )
            print(f"\n{name}: {np.median(taken) / 1e3:.2f} s on {os.cpu_count()} cores")
