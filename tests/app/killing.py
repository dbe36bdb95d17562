"""Programs that edit, killed without warning, and what is left of their work."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

from tests.app.editing_program import UNIT

CHECKOUT = Path(__file__).parents[2]
LONG_SECONDS = 180.0


class EditingProgram:
    """`editing_program`, running, with its own record of what it did."""

    def __init__(self, project: Path, seconds: float, record: Path) -> None:
        self._record = record
        path = os.pathsep.join(map(str, (CHECKOUT, CHECKOUT / "app", CHECKOUT / "resources")))
        with record.open("w") as stream:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "tests.app.editing_program", str(project), str(seconds)],
                stdout=stream,
                stderr=subprocess.DEVNULL,
                cwd=CHECKOUT,
                env={**os.environ, "PYTHONPATH": path},
            )

    def edits(self) -> list[tuple[int, float]]:
        """Return the number and the time of each edit until now."""
        lines = self._record.read_text().splitlines(keepends=True)
        whole = [line.split() for line in lines if line.endswith("\n")]
        return [(int(number), float(moment)) for number, moment in whole]

    def kill_after(self, seconds: float) -> None:
        """Kill the program so long after its first edit."""
        begun = time.monotonic()
        while not (made := self.edits()):
            assert self._process.poll() is None, "the program ended by itself"
            assert time.monotonic() - begun < LONG_SECONDS, "the program never edits"
            time.sleep(0.05)
        time.sleep(max(made[0][1] + seconds - time.time(), 0))
        self._process.kill()
        self._process.wait()


def seconds_lost(made: list[tuple[int, float]], smoothing: float) -> float:
    """Return how long before the last edit the first edit was made that is lost; 0 if none is."""
    kept = round(smoothing / UNIT)
    lost = [moment for number, moment in made if number > kept]
    return made[-1][1] - lost[0] if lost else 0.0
