"""The window as a program whose user edits without a pause, until somebody kills it.

    python -m tests.app.editing_program PROJECT SECONDS_BETWEEN_SAVES

Each edit is told on stdout, once it is made: its number, and the time.
"""

import itertools
import sys
import time
from pathlib import Path

from flyreg_gui.application import run
from flyreg_gui.main import Request
from flyreg_gui.main_window import MainWindow
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication

from flyreg_core import edits

EDIT_MS, LONGEST_MS = 50, 120_000
UNIT = 1e-6
"""The smoothing tells which edit it is of."""


def main() -> None:
    """Open a project and edit it."""
    application = QApplication(sys.argv[:1])
    numbers = itertools.count(1)

    def edit() -> None:
        window = next(w for w in application.topLevelWidgets() if isinstance(w, MainWindow))
        if window.session.project is None:
            return
        number = next(numbers)
        if number == 1:
            window.autosave.set_seconds(float(sys.argv[2]))
        changed = edits.set_smoothing(window.session.project, number * UNIT)
        window.session.edit(f"edit {number}", changed)
        sys.stdout.write(f"{number} {time.time()}\n")
        sys.stdout.flush()

    timer = QTimer()
    timer.timeout.connect(edit)
    timer.start(EDIT_MS)
    QTimer.singleShot(LONGEST_MS, application.quit)  # nobody came to kill it
    run(Request(project=Path(sys.argv[1])))


if __name__ == "__main__":
    main()
