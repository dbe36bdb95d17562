"""The runner with a stand-in for the pipeline that waits until the test lets it go on."""

from __future__ import annotations

import threading
from dataclasses import replace

import pytest

from flyreg_core.errors import LandmarkError
from flyreg_core.project import Brain, BrainInput, Project

pytest.importorskip("PySide6")
from flyreg_gui import runner as runner_module
from flyreg_gui.runner import Runner

PATIENCE_S = 10


def make_project(smoothing: float = 1e-3, name: str = "a") -> Project:
    brain = Brain(BrainInput(name, f"/{name}.ply", "0", "um", "stated by the user"))
    return Project(brain, brain, smoothing=smoothing)


class StepwisePipeline:
    """Each run begins, waits for `go_on`, and then reports and returns or raises."""

    def __init__(self):
        self.begun = threading.Semaphore(0)
        self.may_go_on = threading.Semaphore(0)
        self.seen = []
        self.error = None

    def run(self, project, report, measure):
        self.seen.append((project, measure))
        self.begun.release()
        assert self.may_go_on.acquire(timeout=PATIENCE_S)
        report(0.5, "half way")
        if self.error is not None:
            raise self.error
        return ("results of", project)

    def wait_begun(self):
        assert self.begun.acquire(timeout=PATIENCE_S)

    def go_on(self):
        self.may_go_on.release()


@pytest.fixture
def pipeline():
    return StepwisePipeline()


@pytest.fixture
def runner(qapp, pipeline):
    runner = Runner(pipeline)
    yield runner
    runner.cancel()
    for _ in range(20):
        pipeline.go_on()
    runner.close()


def test_a_project_runs_and_its_results_come_back(qtbot, runner, pipeline):
    project = make_project()
    pipeline.go_on()
    with qtbot.waitSignal(runner.finished) as finished:
        run = runner.submit(project)
    assert finished.args[:2] == [run, ("results of", project)]
    assert finished.args[2] >= 0


def test_of_those_that_wait_only_the_newest_runs(qtbot, runner, pipeline):
    projects = [make_project(smoothing=10.0**-k) for k in range(1, 6)]
    finished = []
    runner.finished.connect(lambda run, results, seconds: finished.append(run.project))
    runner.submit(projects[0])
    pipeline.wait_begun()
    for project in projects[1:]:
        runner.submit(project)
    pipeline.go_on()
    pipeline.go_on()
    qtbot.waitUntil(lambda: projects[-1] in finished)
    assert [project for project, _ in pipeline.seen] == [projects[0], projects[-1]]


def test_an_outdated_run_finishes_if_only_the_spline_differs(qtbot, runner, pipeline):
    finished = []
    runner.finished.connect(lambda run, results, seconds: finished.append(run.number))
    first = runner.submit(make_project(1e-3))
    pipeline.wait_begun()
    second = runner.submit(make_project(1e-2))
    pipeline.go_on()
    pipeline.go_on()
    qtbot.waitUntil(lambda: len(finished) == 2)
    assert finished == [first.number, second.number]


def test_an_outdated_run_is_stopped_if_the_brains_differ(qtbot, runner, pipeline):
    runner.submit(make_project(name="a"))
    pipeline.wait_begun()
    with qtbot.waitSignal(runner.stopped) as stopped:
        runner.submit(make_project(name="b"))
        pipeline.go_on()
    assert stopped.args[0].project.source.input.name == "a"


def test_measuring_is_stopped_by_anything_newer(qtbot, runner, pipeline):
    runner.submit(make_project(1e-3), measure=True)
    pipeline.wait_begun()
    with qtbot.waitSignal(runner.stopped) as stopped:
        runner.submit(make_project(1e-2))
        pipeline.go_on()
    assert stopped.args[0].measure


def test_cancelling_stops_what_runs(qtbot, runner, pipeline):
    runner.submit(make_project())
    pipeline.wait_begun()
    with qtbot.waitSignal(runner.stopped):
        runner.cancel()
        pipeline.go_on()


def test_an_error_comes_back_with_its_run_and_the_next_run_works(qtbot, runner, pipeline):
    pipeline.error = LandmarkError("the landmarks lie on one line")
    pipeline.go_on()
    with qtbot.waitSignal(runner.failed) as failed:
        run = runner.submit(make_project())
    assert failed.args == [run, pipeline.error]
    pipeline.error = None
    pipeline.go_on()
    with qtbot.waitSignal(runner.finished):
        runner.submit(replace(run.project, smoothing=1.0))


def test_closing_waits_for_the_thread(qapp, pipeline):
    runner = Runner(pipeline)
    runner.submit(make_project())
    pipeline.wait_begun()
    pipeline.go_on()
    runner.close()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("flyreg")]


def test_what_is_asked_for_after_closing_is_not_run(runner, pipeline):
    runner.close()
    runner.submit(make_project())
    assert pipeline.seen == []


def test_a_paced_run_waits_until_the_results_before_it_are_drawn(
    qtbot, runner, pipeline, monkeypatch
):
    monkeypatch.setattr(runner_module, "MOST_WAITED_S", 2 * PATIENCE_S)
    runner.pace(True)
    pipeline.go_on()
    with qtbot.waitSignal(runner.finished):
        runner.submit(make_project(1e-3))
    pipeline.wait_begun()
    newest = make_project(1e-2)
    runner.submit(make_project(1e-4))
    runner.submit(newest)
    assert not pipeline.begun.acquire(timeout=0.2)
    runner.begin_next()
    pipeline.wait_begun()
    assert pipeline.seen[-1][0] is newest


def test_a_paced_run_waits_no_more_than_a_moment(qtbot, runner, pipeline):
    runner.pace(True)
    pipeline.go_on()
    with qtbot.waitSignal(runner.finished):
        runner.submit(make_project(1e-3))
    pipeline.wait_begun()
    runner.submit(make_project(1e-2))
    pipeline.wait_begun()
