"""Run the tests from a checkout: ``python3 tests [PYTEST ARGUMENTS]``.

Sets up what is missing, then runs pytest.  On Linux the windows that the tests open go to a display
that nobody sees.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "app"))

import environment
import programs
import system_packages

ON_ALL_CORES = ["-n", "auto", "--dist", "loadgroup"]
"""How all tests are run; a few run in one process, which shows what they print."""


def main(arguments: list[str]) -> int:
    """Run pytest with the given arguments; return its exit status."""
    system_packages.prepare_system(window=True, private=True)
    system_packages.require_window(private=True)
    python = environment.set_up("test").program("python")
    with environment.private_display() as variables:
        return programs.run(
            [python, "-m", "pytest", *(arguments or ON_ALL_CORES)],
            variables,
            folder=environment.CHECKOUT,
            interactive=True,
        )


if __name__ == "__main__":
    sys.exit(programs.run_to_exit_status(main))
