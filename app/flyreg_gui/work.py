"""One piece of work beside the window, which can be watched and cancelled."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from PySide6.QtCore import QObject, Signal

from flyreg_core.errors import Cancelled
from flyreg_core.progress import Report
from flyreg_gui.runner import Clock

Task = Callable[[Report], object]


class Work(QObject):
    """Runs a task on a thread of its own; ends with exactly one of three signals.

    Unlike the runner's projects a task is done once, and nothing newer takes its place.
    """

    progressed = Signal(float, str)
    finished = Signal(object)  # what the task returned
    failed = Signal(object)  # exception
    stopped = Signal()  # cancelled

    def __init__(self, task: Task, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._task = task
        self._is_cancelled = False
        self._is_due = Clock()
        self._executor = ThreadPoolExecutor(max_workers=1, thread_name_prefix="flyreg-work")

    def start(self) -> None:
        """Begin."""
        self._executor.submit(self._run)

    def cancel(self) -> None:
        """Have the task stopped at its next report."""
        self._is_cancelled = True

    def close(self) -> None:
        """Cancel, and wait for the thread."""
        self.cancel()
        self._executor.shutdown(wait=True, cancel_futures=True)

    def _run(self) -> None:  # worker thread from here on
        try:
            result = self._task(self._report)
        except Cancelled:
            self.stopped.emit()
        except Exception as error:  # shown to the user; nothing may end the thread silently
            self.failed.emit(error)
        else:
            self.finished.emit(result)

    def _report(self, fraction: float, text: str) -> None:
        if self._is_cancelled:
            raise Cancelled
        if self._is_due():
            self.progressed.emit(fraction, text)
