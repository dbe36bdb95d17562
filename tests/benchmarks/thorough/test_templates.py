"""What preparing each template takes, and what becomes of it, as a table in Markdown."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from typing import Any

import pytest

from flyreg_core.brain_files import open_brain
from flyreg_core.landmarks import HALVES
from flyreg_core.orientation import orientations
from flyreg_core.pipeline import Pipeline
from flyreg_core.project import Brain
from tests.core.test_templates_prepared import TEMPLATES

MOST_MEGABYTES = 1500
COLUMNS = (
    *("template", "vertices", "genus", "oesophagus, um", "chosen", "flipped", "of"),
    *("deviation mean, %", "p99, %", "filled, %", "bridged, %", "drilled, %", "s", "CPU s", "MB"),
)


def prepared(name: str, folder: Path) -> tuple[dict[str, Any], float, float]:
    """Prepare a template as a process of its own: what it tells, seconds, seconds of CPU."""
    resource = pytest.importorskip("resource")
    command = [sys.executable, "-m", "flyreg_core.cli", "prepare", name, "--json"]
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(
        [*command, "-o", str(folder / "a.ply")], capture_output=True, text=True, check=True
    )
    seconds, after = time.perf_counter() - started, resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return json.loads(done.stdout), seconds, cpu


def flipped(name: str) -> tuple[int, int]:
    """Count the triangles that are turned over where the halves lie flat, and all of them."""
    halves = Pipeline().prepare(Brain(open_brain(name))).halves
    signs = [orientations(halves[half].flat.corners) for half in HALVES]
    return sum(int((sign <= 0).sum()) for sign in signs), sum(map(len, signs))


def test_all_templates_fit_a_laptop_and_lie_flat_without_a_fold(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # all processes first: one that a large process starts counts that one's memory as its own
    runs = {name: prepared(name, tmp_path) for name in TEMPLATES}
    folds = {name: flipped(name) for name in TEMPLATES}
    rows = ["| " + " | ".join(COLUMNS) + " |", "|---" * len(COLUMNS) + "|"]
    for name, (facts, seconds, cpu) in runs.items():
        deviation, origin = facts["deviation"], facts["vertices_by_origin"]
        row = [name, f"{facts['vertices']:,}", facts["genus"]]
        row += [f"{facts['handle']['width_um']:.0f}"]
        row += ["guess" if facts["handle"]["is_guess"] else "sure", *folds[name]]
        row += [f"{100 * deviation[k] / facts['diagonal_um']:.3f}" for k in ("mean_um", "p99_um")]
        shares = [origin[k] / facts["vertices"] for k in ("filled", "bridged", "drilled")]
        row += [f"{100 * share:.1f}" for share in shares]
        row += [f"{seconds:.1f}", f"{cpu:.1f}", f"{facts['peak_memory_mb'] or 0:.0f}"]
        rows.append("| " + " | ".join(map(str, row)) + " |")
    all_seconds = [seconds for _, seconds, _ in runs.values()]
    with capsys.disabled():
        print("\n" + "\n".join(rows))
        print(f"median {median(all_seconds):.1f} s, longest {max(all_seconds):.1f} s")
    assert max(facts["peak_memory_mb"] or 0 for facts, _, _ in runs.values()) <= MOST_MEGABYTES
    assert all(facts["genus"] == 1 for facts, _, _ in runs.values())
    assert all(turned == 0 for turned, _ in folds.values())
