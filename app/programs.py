"""Run programs, end them on Ctrl-C, and tell the user what happens.

Standard library only: this runs before anything is installed.
"""

from __future__ import annotations

import contextlib
import os
import platform
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType

OLDEST_PYTHON = (3, 11)
SET_UP_FAILED = 3
INTERRUPTED = 130

ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Signals that end this program and what it has started, as Ctrl-C does."""

SECONDS_TO_END = 0.2
SECONDS_TO_REPORT = 0.5


class SetUpError(Exception):
    """Something that only the user can change; the message is written for the user."""


def say(text: str) -> None:
    """Tell the user on standard error, which leaves standard output to results."""
    print(f"flyreg: {text}", file=sys.stderr, flush=True)


def run_to_exit_status(main: Callable[[list[str]], int]) -> int:
    """Run a program's main function; turn what can stop it into an exit status.

    Parameters
    ----------
    main : callable
        Takes the command line's arguments, returns an exit status.

    Returns
    -------
    int
        What `main` returned, 3 if this machine could not be set up, 130 after Ctrl-C.
    """
    for number in ENDING:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _exit_on_signal)
    try:
        _check_python()
        return main(sys.argv[1:])
    except KeyboardInterrupt:
        return INTERRUPTED
    except SetUpError as problem:
        say(str(problem))
        return SET_UP_FAILED


def _exit_on_signal(number: int, _frame: FrameType | None) -> None:
    """Leave through the ``finally`` clauses, which end the programs that were started."""
    raise SystemExit(128 + number)


def _check_python() -> None:
    """Refuse a Python that the packages do not support, before they do so at length."""
    if sys.version_info < OLDEST_PYTHON:
        oldest = ".".join(map(str, OLDEST_PYTHON))
        raise SetUpError(
            f"this is Python {platform.python_version()}, and flyreg needs {oldest} or newer. "
            f"If a newer one is installed, name it: python{oldest} {Path(sys.argv[0]).name}"
        )


def child_environment(**changes: str) -> dict[str, str]:
    """Copy this process's environment variables, without those that mislead another Python."""
    misleading = ("PYTHONHOME", "PYTHONPATH", "__PYVENV_LAUNCHER__")
    kept = {name: value for name, value in os.environ.items() if name not in misleading}
    return {**kept, **changes}


def run(
    command: list[str | Path],
    variables: dict[str, str] | None = None,
    *,
    folder: Path | None = None,
    interactive: bool = False,
) -> int:
    """Run a program with its output on show; return its exit status.

    Parameters
    ----------
    command : list of str or Path
        The program and its arguments.
    variables : dict, optional
        Environment variables to change.
    folder : Path, optional
        Where it runs; by default in the current folder.
    interactive : bool
        The program may read the keyboard, and is itself told of Ctrl-C by the terminal.  Any other
        program is ended on Ctrl-C without a chance to show how surprised it is.
    """
    process = None
    try:
        with _signals_held_back():
            process = subprocess.Popen(
                command,
                cwd=folder,
                env=child_environment(**(variables or {})),
                start_new_session=not interactive,
            )
        status = process.wait()
    except KeyboardInterrupt:
        if interactive and process is not None:
            _wait(process, SECONDS_TO_REPORT)
        raise
    finally:
        if process is not None:
            end(process, whole_session=not interactive)
    return status if status >= 0 else 128 - status


@contextlib.contextmanager
def _signals_held_back() -> Iterator[None]:
    """Let signals wait while a program is being started: only then is it known, and can be ended."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    arrived: list[int] = []
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, *ENDING)}
    heard = {number: handler for number, handler in handlers.items() if callable(handler)}
    try:
        for number in heard:
            signal.signal(number, lambda number, _frame: arrived.append(number))
        yield
    finally:
        for number, handler in heard.items():
            signal.signal(number, handler)
    for late in arrived:
        signal.raise_signal(late)


def _wait(process: subprocess.Popen[Any], seconds: float) -> bool:
    """Tell whether a program ends within the given time."""
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        return False
    return True


def end(process: subprocess.Popen[Any], *, whole_session: bool = True) -> None:
    """End a program, and all that it started in a session of its own, if it still runs."""
    if process.poll() is not None:
        return
    signals = [signal.SIGTERM, getattr(signal, "SIGKILL", signal.SIGTERM)]
    for number in signals:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            if whole_session and hasattr(os, "killpg"):
                os.killpg(process.pid, number)
            else:
                process.send_signal(number)
        if _wait(process, SECONDS_TO_END):
            return


def run_quietly(
    command: list[str | Path], *, folder: Path | None = None, finish_alone: bool = False
) -> bool:
    """Run a program without showing its output, except its last lines if it fails.

    Parameters
    ----------
    command : list of str or Path
        The program and its arguments.
    folder : Path, optional
        Where it runs; by default in the current folder.
    finish_alone : bool
        On Ctrl-C only ask the program to stop, and leave it to find a safe point by itself.

    Returns
    -------
    bool
        Whether the program's exit status was 0.
    """
    # A file and not a pipe: a program that is left alone must still be able to write.
    with tempfile.TemporaryFile() as output:
        process = None
        try:
            with _signals_held_back():
                process = subprocess.Popen(
                    command,
                    cwd=folder,
                    env=child_environment(PIP_USER="0", PIP_DISABLE_PIP_VERSION_CHECK="1"),
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                )
            status = process.wait()
        except KeyboardInterrupt:
            if finish_alone and process is not None:
                with contextlib.suppress(PermissionError):
                    process.send_signal(signal.SIGINT)
            raise
        finally:
            if process is not None and not finish_alone:
                end(process)
        if status:
            output.seek(0)
            for line in output.read().decode(errors="replace").splitlines()[-15:]:
                print(f"  {line}", file=sys.stderr)
    return status == 0
