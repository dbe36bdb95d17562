"""What nobody holds any more is looked for and given back while the hand rests.

Python looks for what only refers to itself by itself only after the number of all objects has grown by
a quarter, which among the objects of Qt, VTK and numba takes long; until then arrays that hang on such
a ring stay.
"""

from __future__ import annotations

import gc

from PySide6.QtCore import QObject, QTimer

from flyreg_core.results import Results
from flyreg_gui.memory import give_back
from flyreg_gui.session import Session

RESTS_BETWEEN = 10
"""How often the hand rests from one look to the next."""
PAUSE_MS = 500
"""Until then all views have drawn the newest results, and nobody holds those before."""


class GarbageCollector(QObject):
    """Looks now and then when results are complete: in the window's thread, where objects of Qt die."""

    def __init__(self, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self._rests = 0
        self._session = session
        self._pause = QTimer(self)
        self._pause.setSingleShot(True)
        self._pause.setInterval(PAUSE_MS)
        self._pause.timeout.connect(self._on_pause)
        session.results_changed.connect(self._on_results)

    def _on_results(self, results: Results | None) -> None:
        if results is None or results.distances is None:
            return
        self._rests += 1
        if self._rests % RESTS_BETWEEN == 0:
            gc.collect()
        self._pause.start()

    def _on_pause(self) -> None:
        if self._session.is_complete:
            give_back()
