"""What the window remembers from one time to the next, on this computer."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path

from PySide6.QtCore import QByteArray, QSettings

MOST_RECENT = 8


class Preferences:
    """Typed access to the settings file."""

    def __init__(self) -> None:
        self._settings = QSettings("flyreg", "flyreg")

    @property
    def recent_projects(self) -> list[Path]:
        """Project files that still exist, the last used first."""
        value = self._settings.value("recent_projects", [])
        if isinstance(value, str):  # what a list of one becomes in some formats
            value = [value]
        texts = value if isinstance(value, list) else []
        return [path for path in map(Path, map(str, texts)) if path.is_file()]

    def add_recent(self, path: Path) -> None:
        """Put a project file first."""
        paths = [path.absolute(), *self.recent_projects]
        texts = list(dict.fromkeys(map(str, paths)))[:MOST_RECENT]
        self._settings.setValue("recent_projects", texts)

    @property
    def folder(self) -> str:
        """The folder that a file dialog starts in; empty for the system's choice."""
        folder = str(self._settings.value("folder", ""))
        return folder if Path(folder).is_dir() else ""

    @folder.setter
    def folder(self, folder: str) -> None:
        self._settings.setValue("folder", folder)

    def save_window(self, geometry: QByteArray, state: QByteArray) -> None:
        """Remember where the window and its docks are."""
        self._settings.setValue("window/geometry", geometry)
        self._settings.setValue("window/state", state)

    @property
    def window(self) -> tuple[QByteArray, QByteArray] | None:
        """Where the window and its docks were."""
        geometry = self._settings.value("window/geometry")
        state = self._settings.value("window/state")
        if isinstance(geometry, QByteArray) and isinstance(state, QByteArray):
            return geometry, state
        return None

    @property
    def views(self) -> object:
        """How the views were arranged, as `Arrangement.state` tells it."""
        with suppress(ValueError):
            return json.loads(str(self._settings.value("window/views", "")))
        return None

    @views.setter
    def views(self, state: dict[str, object]) -> None:
        self._settings.setValue("window/views", json.dumps(state))
