"""Twenty programs that register the demo pair and edit, killed without warning."""

from __future__ import annotations

import random

import pytest
from flyreg_resources.demo import make_demo_pair

from flyreg_core.brain_files import open_brain, write_mesh
from flyreg_core.project import Brain, Project
from flyreg_core.project_file import save_project

pytest.importorskip("PySide6")
from flyreg_gui.autosave import DEFAULT_SECONDS, find_left_overs

from tests.app.killing import EditingProgram, seconds_lost

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]

TIMES = 20
MOST_SECONDS = 5.0


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo")
    brains = []
    for name, mesh in zip(("source", "target"), make_demo_pair(), strict=True):
        write_mesh(folder / f"{name}.ply", mesh, "um")
        brains.append(Brain(open_brain(str(folder / f"{name}.ply"), "um")))
    save_project(Project(*brains), folder / "demo.flyreg")
    return folder / "demo.flyreg"


@pytest.mark.parametrize("seed", range(TIMES))
def test_a_killed_program_loses_at_most_five_seconds(project, tmp_path, monkeypatch, seed):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    moment = random.Random(seed).uniform(0.0, 15.0)
    program = EditingProgram(project, DEFAULT_SECONDS, tmp_path / "edits.txt")
    program.kill_after(moment)
    made = program.edits()
    found = find_left_overs(tmp_path / "flyreg" / "autosave")
    smoothing = found[0].load().smoothing if found else 0.0
    lost = seconds_lost(made, smoothing)
    print(f"killed after {moment:.1f} s and {len(made)} edits: {lost:.2f} s lost")
    assert lost <= MOST_SECONDS
    assert len(found) == 1 or moment < MOST_SECONDS
    for left in found:
        left.keep()
