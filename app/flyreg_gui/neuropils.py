"""The neuropils of the open project, read from their files when the project names them."""

from __future__ import annotations

from collections.abc import Mapping

from PySide6.QtCore import QObject, Signal

from flyreg_core.errors import FlyregError
from flyreg_core.neuropils import Neuropil, read_neuropils
from flyreg_core.project import NeuropilFile, Project
from flyreg_gui.failures import sentence_for
from flyreg_gui.session import Session


class Neuropils(QObject):
    """Keeps what was read of each file for as long as the project names it."""

    changed = Signal()
    refused = Signal(str)  # why a file cannot be read

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._read: dict[NeuropilFile, tuple[Neuropil, ...]] = {}
        session.project_changed.connect(self._on_project)

    @property
    def by_name(self) -> Mapping[str, Neuropil]:
        """The neuropils by what the user reads, in the order of the files."""
        return {
            f"{neuropil.name} ({neuropil.role})": neuropil
            for neuropils in self._read.values()
            for neuropil in neuropils
        }

    def _on_project(self, project: Project | None) -> None:
        files = () if project is None else project.neuropils
        if files == tuple(self._read):
            return
        self._read = {file: self._read.get(file) or self._opened(file) for file in files}
        self.changed.emit()

    def _opened(self, file: NeuropilFile) -> tuple[Neuropil, ...]:
        try:
            return read_neuropils(file)
        except (FlyregError, OSError) as error:
            self.refused.emit(sentence_for(error))
            return ()
