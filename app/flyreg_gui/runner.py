"""Runs the pipeline beside the window: one worker thread, the newest project wins."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from PySide6.QtCore import QObject, Signal

from flyreg_core.errors import Cancelled
from flyreg_core.progress import Report
from flyreg_core.project import Project
from flyreg_core.results import Results

SECONDS_BETWEEN_REPORTS = 0.2
MOST_WAITED_S = 0.25
"""So long a run waits for pictures to be drawn; those of a window that is hidden never are."""


class RunsProjects(Protocol):
    """What turns a project into results: the pipeline, or a stand-in for it in a test."""

    def run(self, project: Project, report: Report, measure: bool) -> Results:
        """Return what follows from a project, with or without distances."""
        ...


@dataclass(frozen=True)
class Run:
    """One project on its way through the pipeline. Later runs have greater numbers.

    Distances take longer than all that follows a slider, so they are measured by a run of their
    own (`measure`) once there is nothing newer to show.
    """

    number: int
    project: Project
    measure: bool = False

    def may_finish_beside(self, newest: Project) -> bool:
        """Tell whether the results still help a user whose project is now another one.

        While a slider is dragged each project is outdated before it is through; if all of them
        were stopped the picture would stand still until the hand does.
        """
        if self.measure:
            return False
        mine = (self.project.source, self.project.target, self.project.boundary)
        return mine == (newest.source, newest.target, newest.boundary)


class Runner(QObject):
    """Runs projects through the pipeline: at most one at a time, then the newest that waits."""

    started = Signal(object)  # Run
    progressed = Signal(object, float, str)  # Run, fraction, text
    finished = Signal(object, object, float)  # Run, Results, seconds
    failed = Signal(object, object)  # Run, exception
    stopped = Signal(object)  # Run: outdated or cancelled, nothing came of it

    def __init__(self, pipeline: RunsProjects, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._pipeline = pipeline
        self._newest: Run | None = None
        self._count = 0
        self._is_closed = False
        self._is_paced, self._latest = False, 0.0
        self._may_begin = threading.Event()
        self._may_begin.set()
        self._executor = ThreadPoolExecutor(max_workers=1, thread_name_prefix="flyreg-pipeline")

    def submit(self, project: Project, *, measure: bool = False) -> Run:
        """Run a project as soon as the worker is free, instead of any that waits.

        After `close` nothing is run: results that were on their way may still ask for more.
        """
        self._count += 1
        run = Run(self._count, project, measure)
        if not self._is_closed:
            self._newest = run
            self._executor.submit(self._run, run)
        return run

    def pace(self, on: bool) -> None:
        """Let each run wait until the results of the last are drawn, for a moment at most.

        Drawing without a graphics card takes the processor: side by side, neither is done sooner.
        """
        self._is_paced = on
        self.begin_next()

    def begin_next(self) -> None:
        """Let the next run begin: the results of the last are drawn."""
        self._may_begin.set()

    def cancel(self) -> None:
        """Stop what runs and drop what waits."""
        self._newest = None

    def close(self) -> None:
        """Cancel and wait for the thread; nothing is run afterwards."""
        self._is_closed = True
        self.cancel()
        self.pace(False)
        self._executor.shutdown(wait=True, cancel_futures=True)

    def _run(self, run: Run) -> None:  # worker thread from here on
        self._may_begin.wait(max(self._latest - time.monotonic(), 0.0))
        if run is not self._newest:
            self.stopped.emit(run)
            return
        self.started.emit(run)
        start = time.perf_counter()
        try:
            report = partial(self._report, run, Clock())
            results = self._pipeline.run(run.project, report, run.measure)
        except Cancelled:
            self.stopped.emit(run)
        except Exception as error:  # the session shows it; nothing may end the worker silently
            self.failed.emit(run, error)
        else:
            if self._is_paced:
                self._latest = time.monotonic() + MOST_WAITED_S
                self._may_begin.clear()
            self.finished.emit(run, results, time.perf_counter() - start)

    def _report(self, run: Run, is_due: Callable[[], bool], fraction: float, text: str) -> None:
        newest = self._newest
        if newest is None or not (run is newest or run.may_finish_beside(newest.project)):
            raise Cancelled
        if is_due():
            self.progressed.emit(run, fraction, text)


class Clock:
    """Tells whether it is time for the next report to the window."""

    def __init__(self) -> None:
        self._last = 0.0

    def __call__(self) -> bool:
        """Tell it once in a while."""
        now = time.monotonic()
        if now - self._last < SECONDS_BETWEEN_REPORTS:
            return False
        self._last = now
        return True
