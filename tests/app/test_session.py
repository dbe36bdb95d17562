"""The session, with a pipeline that answers at once and with nothing."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flyreg_core import edits
from flyreg_core.errors import FlyregError, LandmarkError, TopologyError
from flyreg_core.project import Brain, BrainInput, Project

pytest.importorskip("PySide6")
from flyreg_gui.preparing import PreparingError, RawBrain, Remains
from flyreg_gui.runner import Runner
from flyreg_gui.session import Session
from flyreg_gui.steps import State, Step, report_steps

from tests.core.test_edits import EDITS, PROJECT


@dataclass
class InstantPipeline:
    """Results that say which project they belong to, and nothing else."""

    error: Exception | None = None

    def run(self, project, report, measure):
        report(0.1, "reading")
        if self.error is not None:
            raise self.error
        return SimpleNamespace(project=project, distances="measured" if measure else None)


@pytest.fixture
def project() -> Project:
    brain = Brain(BrainInput("a", "/a.ply", "0", "um", "stated by the user"))
    return Project(brain, brain)


@pytest.fixture
def pipeline() -> InstantPipeline:
    return InstantPipeline()


@pytest.fixture
def session(qapp, pipeline):
    runner = Runner(pipeline)
    yield Session(runner)
    runner.close()


def test_results_follow_the_project(qtbot, session, project):
    session.open(project)
    qtbot.waitUntil(lambda: session.is_complete)
    session.edit("smoother", edits.set_smoothing(project, 0.5))
    assert not session.is_up_to_date
    qtbot.waitUntil(lambda: session.is_complete)
    assert session.results.project.smoothing == 0.5


def test_undo_and_redo_restore_the_very_projects(session, project):
    session.open(project)
    changed = edits.set_weight(project, "upper-01", 3.0)
    session.edit("heavier", changed)
    session.undo_stack.undo()
    assert session.project is project
    session.undo_stack.redo()
    assert session.project is changed


def test_an_edit_that_changes_nothing_is_no_step(session, project):
    session.open(project)
    session.edit("nothing", edits.set_smoothing(project, project.smoothing))
    assert session.undo_stack.count() == 0


def test_the_edits_of_a_gesture_are_one_step(session, project):
    session.open(project)
    session.begin_gesture()
    for value in (0.1, 0.2, 0.3):
        session.edit("drag", edits.set_smoothing(session.project, value))
    session.end_gesture()
    assert session.undo_stack.count() == 1
    session.undo_stack.undo()
    assert session.project is project


def test_two_gestures_are_two_steps(session, project):
    session.open(project)
    for value in (0.1, 0.2):
        session.begin_gesture()
        session.edit("drag", edits.set_smoothing(session.project, value))
        session.end_gesture()
    assert session.undo_stack.count() == 2


def test_a_gesture_that_comes_back_is_no_step(session, project):
    session.open(project)
    session.begin_gesture()
    session.edit("drag", edits.set_smoothing(project, 0.5))
    session.edit("drag", edits.set_smoothing(project, project.smoothing))
    session.end_gesture()
    assert session.project == project
    assert not session.undo_stack.canUndo()


def test_distances_are_measured_only_after_the_gesture(qtbot, session, project):
    session.open(project)
    qtbot.waitUntil(lambda: session.is_complete)
    session.begin_gesture()
    session.edit("drag", edits.set_smoothing(project, 0.5))
    qtbot.waitUntil(lambda: session.is_up_to_date and not session.is_running)
    assert session.results.distances is None
    session.end_gesture()
    qtbot.waitUntil(lambda: session.is_complete)


def test_unsaved_changes_are_named_until_saved(session, project, tmp_path):
    session.open(project)
    assert session.unsaved_changes == []
    session.edit("change smoothing", edits.set_smoothing(project, 0.5))
    session.edit("heavier", edits.set_weight(session.project, "upper-01", 3.0))
    assert session.unsaved_changes == ["change smoothing", "heavier"]
    session.mark_saved(tmp_path / "p.flyreg")
    assert session.unsaved_changes == []
    session.undo_stack.undo()
    assert session.unsaved_changes != []


def test_a_failure_keeps_the_earlier_results(qtbot, session, project, pipeline):
    session.open(project)
    qtbot.waitUntil(lambda: session.is_complete)
    shown = session.results
    pipeline.error = TopologyError("the brain has no hole")
    session.edit("smoother", edits.set_smoothing(project, 0.5))
    qtbot.waitUntil(lambda: session.failure is not None)
    assert session.failure.sentence == "the brain has no hole"
    assert not session.failure.is_internal
    assert session.results is shown


def test_an_internal_error_goes_to_a_log_that_is_named(qtbot, session, project, pipeline):
    pipeline.error = ZeroDivisionError("ratio of nothing")
    session.open(project)
    qtbot.waitUntil(lambda: session.failure is not None)
    assert session.failure.is_internal
    assert "ratio of nothing" not in session.failure.sentence
    log = session.failure.sentence.rsplit(" ", 1)[-1]
    with open(log, encoding="utf-8") as file:
        assert "ratio of nothing" in file.read()


def test_results_of_a_closed_project_are_not_shown(qtbot, session, project):
    other = edits.set_smoothing(project, 0.7)
    session.open(project)
    session.open(other)
    qtbot.waitUntil(lambda: session.is_complete)
    assert session.results.project is other


def test_steps_tell_what_fails(qtbot, session, project, pipeline):
    assert {report.state for report in report_steps(session)} == {State.WAITING}
    pipeline.error = FlyregError("this brain cannot be used")
    session.open(project)
    qtbot.waitUntil(lambda: session.failure is not None)
    states = [report.state for report in report_steps(session)]
    assert states[Step.BRAINS] is State.FAILED
    assert states[Step.JUDGE] is State.WAITING


@settings(deadline=None, max_examples=40, suppress_health_check=list(HealthCheck))
@given(steps=st.lists(EDITS, max_size=12))
def test_as_many_undos_as_steps_restore_the_project(session, steps):
    session.open(PROJECT)
    make_edits(session, steps)
    final, count = session.project, session.undo_stack.count()
    for _ in range(count):
        session.undo_stack.undo()
    assert session.project is PROJECT
    assert session.unsaved_changes == []
    for _ in range(count):
        session.undo_stack.redo()
    assert session.project is final


def make_edits(session, steps):
    for edit, *arguments in steps:
        try:
            changed = edit(session.project, *arguments)
        except LandmarkError:
            continue  # the window refuses it with a sentence
        session.edit(edit.__name__, changed)


def test_a_brain_that_cannot_be_prepared_is_named_and_what_is_left_of_it_is_kept(
    qtbot, session, project, pipeline
):
    raw = RawBrain(SimpleNamespace(), SimpleNamespace())
    remains = Remains("target", {"target": raw})
    pipeline.error = PreparingError(TopologyError("there is no tunnel"), remains)
    session.open(project)
    qtbot.waitUntil(lambda: session.failure is not None)
    assert session.failure.sentence == "Target: there is no tunnel"
    assert not session.failure.is_internal
    assert session.brain("target").raw is raw.surface
    assert session.brain("source") is None
    session.edit("smoother", edits.set_smoothing(project, 0.5))
    assert session.brain("target") is not None  # until there is something better
    pipeline.error = None
    session.run_again()
    qtbot.waitUntil(lambda: session.results is not None)
    assert session.remains is None
