"""The source's neuropils carried to the target, found beside the window while the hand rests."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from PySide6.QtCore import QObject, Signal

from flyreg_core.neuropils import Neuropil
from flyreg_core.results import Results
from flyreg_core.transform import carry
from flyreg_gui.neuropils import Neuropils
from flyreg_gui.session import Session


@dataclass(frozen=True, eq=False)
class Task:
    """What is to be carried, and along which registration."""

    results: Results
    neuropils: Mapping[str, Neuropil]


class CarriedNeuropils(QObject):
    """Where a registration takes the source's neuropils; those of the one before until it is known."""

    changed = Signal()
    _found = Signal(object, object)  # Task, and its neuropils as they were carried

    def __init__(self, session: Session, neuropils: Neuropils, parent: QObject) -> None:
        super().__init__(parent)
        self._session, self._neuropils = session, neuropils
        self.by_name: Mapping[str, Neuropil] = {}
        self._newest: Task | None = None
        self._executor = ThreadPoolExecutor(max_workers=1, thread_name_prefix="flyreg-carrying")
        self._found.connect(self._on_found)
        session.results_changed.connect(self._on_news)
        neuropils.changed.connect(self._on_news)

    def close(self) -> None:
        """Wait for the thread; nothing is carried afterwards."""
        self._session.results_changed.disconnect(self._on_news)
        self._newest = None
        self._executor.shutdown(wait=True, cancel_futures=True)

    def _on_news(self, *_news: object) -> None:
        results = self._session.results
        own = {
            name: each for name, each in self._neuropils.by_name.items() if each.role == "source"
        }
        kept = {
            name: each for name, each in self.by_name.items() if results is not None and name in own
        }
        if len(kept) < len(self.by_name):
            self.by_name = kept
            self.changed.emit()
        if not own or results is None or results.distances is None:
            return  # until the hand rests
        newest = self._newest
        if newest is None or newest.results is not results or newest.neuropils != own:
            self._newest = Task(results, own)
            self._executor.submit(self._run, self._newest)

    def _run(self, task: Task) -> None:  # worker thread from here on
        carried = {}
        for name, neuropil in task.neuropils.items():
            if task is not self._newest:
                return
            vertices = carry(neuropil.surface.vertices, task.results, np.inf).points
            carried[name] = replace(
                neuropil, role="target", surface=neuropil.surface.moved(vertices)
            )
        self._found.emit(task, carried)

    def _on_found(self, task: Task, carried: Mapping[str, Neuropil]) -> None:
        if task is self._newest:
            self.by_name = carried
            self.changed.emit()
