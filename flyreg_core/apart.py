"""Run a task in a process of its own, so that its time and memory are its own and have limits.

A task is a frozen dataclass of the engine with a method `run`; it goes to the process, and what it
returns comes back, as an archive. The process is `python -m flyreg_core.apart FOLDER`; it ends when
the one who waits for it does, however that ends.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import psutil

from flyreg_core.archive import read_archive, write_archive
from flyreg_core.errors import FlyregError
from flyreg_core.progress import Report
from flyreg_core.rivals.rival import lacks

POLL_SECONDS = 0.02
"""How often time and memory are looked at; a shorter peak of memory is not seen."""
TASK, STARTED, FINISHED, ANSWER = "task", "started", "finished", "answer"
"""Files in the folder of a process: what it does, marks of when it does it, and what came of it."""
DESERTED = 3
"""How a process ends that nobody waits for any more."""


class Task(Protocol):
    """What can be run apart."""

    def run(self) -> object:
        """Return a value that an archive can hold."""


@dataclass(frozen=True)
class Limits:
    """What a task may take; None: as much as it wants."""

    seconds: float | None = 60.0
    megabytes: float | None = 3000.0

    def __post_init__(self) -> None:
        for name, value in (("seconds", self.seconds), ("megabytes", self.megabytes)):
            if value is not None and not value > 0:
                raise FlyregError(f"a limit must be a positive number of {name}, not {value:g}")


@dataclass(frozen=True, eq=False)
class Done:
    """What became of a task."""

    value: object | None  # None: it did not come to its end
    sentence: str  # "done", or why not
    seconds: float | None  # of the task, without the start of its process
    peak_memory_mb: float | None  # of its process

    @property
    def is_done(self) -> bool:
        """Tell whether there is a value."""
        return self.value is not None


@dataclass(frozen=True, eq=False)
class _Answer:
    value: object | None
    sentence: str
    seconds: float


def run_apart(task: Task, limits: Limits, report: Report, text: str) -> Done:
    """Run a task in a process that is ended when it takes too much, or when `report` says so.

    Whatever goes wrong in the process comes back as a sentence.
    """
    with tempfile.TemporaryDirectory(prefix="flyreg-") as name:
        folder = Path(name)
        with (folder / TASK).open("wb") as file:
            write_archive(file, task)
        apart = subprocess.Popen(
            [sys.executable, "-m", __name__, name],
            stdin=subprocess.PIPE,  # closed by the system when this process is gone
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C is for the one who waits
        )
        try:
            peak, why = _watched(apart, folder, limits, report, text)
        finally:
            apart.kill()
            apart.communicate()
        if why:
            return Done(None, why, None, peak)
        answer = _answer(folder / ANSWER, apart.returncode)
        return Done(
            answer.value, answer.sentence, None if answer.value is None else answer.seconds, peak
        )


def _watched(
    apart: subprocess.Popen[bytes], folder: Path, limits: Limits, report: Report, text: str
) -> tuple[float, str]:
    """Wait for a process; return its peak memory, and why it has to be ended, if it has."""
    begun, peak = time.monotonic(), 0.0
    process = psutil.Process(apart.pid)
    started = finished = False
    while apart.poll() is None:
        if not started and (folder / STARTED).exists():  # from here on the time is the task's
            started, begun = True, time.monotonic()
        finished = finished or (folder / FINISHED).exists()
        with suppress(psutil.Error):
            peak = max(peak, round(process.memory_info().rss / 2**20, 1))
        seconds = time.monotonic() - begun
        if limits.megabytes is not None and peak > limits.megabytes:
            return peak, f"needed more than {limits.megabytes:g} MB of memory and was ended"
        if limits.seconds is not None and started and not finished and seconds > limits.seconds:
            return peak, f"took longer than {limits.seconds:g} s and was ended"
        report(min(seconds / limits.seconds, 1.0) if started and limits.seconds else 0.0, text)
        time.sleep(POLL_SECONDS)
    return peak, ""


def _answer(path: Path, status: int) -> _Answer:
    if status == 0 and path.exists():
        with path.open("rb") as file:
            answer = read_archive(file)
        if isinstance(answer, _Answer):
            return answer
    return _Answer(None, f"its process ended early, with status {status}", 0.0)


def _end_when_deserted(folder: Path) -> None:
    """End this process, and take its folder away, when the other end of its input is closed."""
    os.read(sys.stdin.fileno(), 1)
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(DESERTED)


def _work(folder: Path) -> None:
    """Run the task in a folder and leave its answer there."""
    threading.Thread(target=_end_when_deserted, args=(folder,), daemon=True).start()
    with (folder / TASK).open("rb") as file:
        task: Task = read_archive(file)  # type: ignore[assignment]
    (folder / STARTED).touch()
    begun = time.perf_counter()
    value: object | None = None
    try:
        value, sentence = task.run(), "done"
    except FlyregError as error:
        sentence = str(error)
    except ImportError as error:
        sentence = lacks(error.name)
    except MemoryError:
        sentence = "there is not enough memory for it"
    except BaseException as error:  # whatever a rival's package raises; the comparison goes on
        sentence = f"failed: {type(error).__name__}: {error}"
    answer = _Answer(value, sentence, time.perf_counter() - begun)
    (folder / FINISHED).touch()
    with (folder / ANSWER).open("wb") as file:
        write_archive(file, answer)


if __name__ == "__main__":
    from flyreg_core import apart  # by its name, which archives need

    apart._work(Path(sys.argv[1]))
