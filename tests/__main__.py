"""Run the tests from a checkout: ``python3 tests [PYTEST ARGUMENTS]``.

Sets up what is missing, then runs pytest.  On Linux the windows that the tests open go to displays
that nobody sees, one for each process, so that no two windows take each other's keys or pointer.
"""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "app"))

import environment
import programs
import system_packages

DISPLAYS = "FLYREG_TEST_DISPLAYS"
"""The variable that names a display for each process; conftest.py reads it."""
MOST_PROCESSES = 4
"""Each takes about 1.5 GB of memory."""


def on_all_cores() -> tuple[int, list[str]]:
    """Give in how many processes all tests run, and how; a few run in one, which can print."""
    count = min(os.cpu_count() or 1, MOST_PROCESSES)
    return count, ["-n", str(count), "--durations", "15"]


def main(arguments: list[str]) -> int:
    """Run pytest with the given arguments; return its exit status."""
    system_packages.prepare_system(window=True, private=True)
    system_packages.require_window(private=True)
    python = environment.set_up("test").program("python")
    processes, options = (1, arguments) if arguments else on_all_cores()
    with contextlib.ExitStack() as stack:
        displays = [stack.enter_context(environment.private_display()) for _ in range(processes)]
        variables = dict(displays[0])
        if variables:
            variables[DISPLAYS] = " ".join(display["DISPLAY"] for display in displays)
        return programs.run(
            [python, "-m", "pytest", *options],
            variables,
            folder=environment.CHECKOUT,
            interactive=True,
        )


if __name__ == "__main__":
    sys.exit(programs.run_to_exit_status(main))
