"""How a whole tick grows with the source's vertices and with the landmarks, as a table and a plot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flyreg_core import edits
from flyreg_core.brain_files import open_brain
from flyreg_core.chart import Axis, Line, Panel, draw_panels
from flyreg_core.pipeline import Pipeline
from flyreg_core.project import Brain, Project
from flyreg_core.solid import SolidParameters
from tests.benchmarks.thorough.test_live import milliseconds, with_landmarks

PLOT = Path(__file__).resolve().parents[3] / "resources" / "pictures" / "growth.svg"
VOXELS_ACROSS = (22, 40, 60, 90, 134)
"""Give FCWB about 10,000 to 400,000 vertices."""
LANDMARKS = (150, 500, 1000, 2000, 4000)
TICKS = 20


def whole_ticks(pipeline: Pipeline, project: Project) -> dict[str, np.ndarray]:
    """Return how long a tick of each kind takes, milliseconds."""
    landmarks = pipeline.run(project, measure=False).landmarks
    own = next(mark.pair.id for mark in landmarks if mark.plane and mark.pair.origin == "user")
    works: dict[str, Callable[[int], Project]] = {
        "one weight": lambda tick: edits.set_weight(project, own, 0.1 + tick),
        "lambda": lambda tick: edits.set_smoothing(project, 0.011 * 1.05**tick),
    }
    return {
        name: milliseconds(lambda tick, to=to: pipeline.run(to(tick), measure=False), TICKS)
        for name, to in works.items()
    }


def test_how_a_tick_grows(capsys: pytest.CaptureFixture[str]) -> None:
    medians: dict[tuple[str, int], list[tuple[int, float]]] = {}
    lines = ["", "| vertices | landmarks | tick | median, ms | 95th percentile, ms |"]
    lines.append("|---|---|---|---|---|")
    for across in VOXELS_ACROSS:
        pipeline = Pipeline()
        source = Brain(open_brain("FCWB"), solid=SolidParameters(across))
        results = pipeline.run(Project(source, Brain(open_brain("JFRC2"))), measure=False)
        vertices = len(results.source.surface.vertices)
        for count in LANDMARKS:
            for name, taken in whole_ticks(pipeline, with_landmarks(results, count)).items():
                middle, high = np.percentile(taken, [50, 95])
                lines.append(f"| {vertices:,} | {count:,} | {name} | {middle:.1f} | {high:.1f} |")
                medians.setdefault((name, count), []).append((vertices, float(middle)))
    panels = [
        Panel(
            f"A whole tick: {name}",
            tuple(
                Line(f"{count:,} landmarks", *zip(*medians[name, count], strict=True))
                for count in LANDMARKS
                if (name, count) in medians
            ),
            Axis("vertices of the source", is_logarithmic=True),
            Axis("ms", is_logarithmic=True),
        )
        for name in ("one weight", "lambda")
    ]
    PLOT.write_text(draw_panels(panels, 2, paper="#ffffff"), encoding="utf-8")
    with capsys.disabled():
        print("\n".join([*lines, f"plotted in {PLOT}"]))
