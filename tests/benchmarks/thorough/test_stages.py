"""What the slower stages take at 100,000 vertices, and a whole registration by command."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pymeshlab
import pytest

from flyreg_core.brain_files import open_brain
from flyreg_core.cache import open_cache
from flyreg_core.flatten import FlattenParameters
from flyreg_core.halves import lay_flat
from flyreg_core.landmarks import HALVES
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.pipeline import Pipeline
from flyreg_core.progress import ignore
from flyreg_core.project import Brain, Project
from flyreg_core.results import Results
from flyreg_core.smooth import SmoothParameters, smooth
from flyreg_core.solid import SolidParameters
from flyreg_core.strip_warp import draw_along
from flyreg_core.surface_distance import measure_distances
from tests.benchmarks.thorough.test_live import FINE

SAMPLES = 500_000
AGREE = 0.01


@pytest.fixture(scope="module")
def results() -> Results:
    """FCWB on JFRC2, the source finely cut."""
    fine = Brain(open_brain("FCWB"), solid=SolidParameters(FINE))
    return Pipeline(open_cache()).run(Project(fine, Brain(open_brain("JFRC2"))), measure=False)


def seconds(work: Callable[[], object], times: int = 3) -> float:
    """Return how long the second and later of several calls take, in the middle."""
    taken = []
    for _ in range(times + 1):
        start = time.perf_counter()
        work()
        taken.append(time.perf_counter() - start)
    return float(np.median(taken[1:]))


def test_stages(results: Results, capsys: pytest.CaptureFixture[str]) -> None:
    source, surface = results.source.flat, results.source.surface
    passes = seconds(lambda: smooth(surface.vertices, surface.faces, SmoothParameters(), ignore))
    half = HALVES[0]
    flat = seconds(
        lambda: lay_flat(source.dissection, source.curves, half, FlattenParameters(), ignore)
    )
    laid = source.halves[half]
    start, still = laid.flat.uv[:, 0], np.zeros(len(laid.vertex_of))
    rng = np.random.default_rng(0)
    misses = (rng.normal(0, 0.01, (len(laid.outer), 2)), rng.normal(0, 0.01, (len(laid.hole), 2)))
    moved = seconds(lambda: draw_along(start, still, laid.flat.uv[:, 1], laid.fadings, misses), 40)
    with capsys.disabled():
        count = len(laid.vertex_of)
        print(f"\n500 passes, {len(surface.vertices):,} vertices: {passes:.2f} s")
        print(f"laying the {half} half flat, {count:,} vertices: {flat:.2f} s")
        print(f"moving its boundary, which draws all of it along: {1e3 * moved:.1f} ms")


def test_distances(results: Results, capsys: pytest.CaptureFixture[str]) -> None:
    registered, target = results.registration.surface, results.target.surface
    own = measure_distances(registered, target, ignore, SAMPLES)
    taken = seconds(lambda: measure_distances(registered, target, ignore, SAMPLES))
    start = time.perf_counter()
    others = by_meshlab(registered, target), by_meshlab(target, registered)
    others_taken = time.perf_counter() - start
    with capsys.disabled():
        print(f"\ndistances both ways, {SAMPLES:,} samples each: {taken:.2f} s", end=", ")
        print(f"MeshLab {others_taken:.1f} s: {others_taken / taken:.0f} times as long")
    for mine, other in zip((own.a_to_b, own.b_to_a), others, strict=True):
        assert mine.mean_um == pytest.approx(other["mean"], rel=AGREE)


def by_meshlab(a: SurfaceMesh, b: SurfaceMesh) -> dict[str, float]:
    meshes = pymeshlab.MeshSet()
    for surface in (a, b):
        meshes.add_mesh(pymeshlab.Mesh(surface.vertices, surface.faces.astype(np.int32)))
    found: dict[str, float] = meshes.get_hausdorff_distance(
        sampledmesh=0,
        targetmesh=1,
        samplenum=SAMPLES,
        samplevert=False,
        sampleface=True,
        maxdist=pymeshlab.PercentageValue(100),
    )
    return found


def test_registering_by_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fine = ["--voxels", str(FINE)]
    runs = (
        ("nothing cached", "a", []),
        ("cached", "a", []),
        ("100,000 vertices, nothing cached", "b", fine),
        ("100,000 vertices, cached", "b", fine),
    )
    with capsys.disabled():
        print()
        for name, cache, options in runs:
            folder = tmp_path / name
            command = [sys.executable, "-m", "flyreg_core.cli", "register", "FCWB", "JFRC2"]
            start = time.perf_counter()
            subprocess.run(
                [*command, "-o", str(folder), *options],
                env=os.environ | {"FLYREG_CACHE": str(tmp_path / cache)},
                capture_output=True,
                check=True,
            )
            taken = time.perf_counter() - start
            facts = json.loads((folder / "report.json").read_text(encoding="utf-8"))
            megabytes = facts["peak_memory_mb"]
            print(f"register FCWB JFRC2, {name}: {taken:.1f} s, {megabytes:.0f} MB", flush=True)
