"""What the window remembers from one time to the next, on this computer."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import get_args

from PySide6.QtCore import QByteArray, QSettings

from flyreg_core.project import BrainInput, Unit
from flyreg_core.templates import template_labels
from flyreg_gui.autosave import DEFAULT_SECONDS
from flyreg_gui.theme import Scheme

MOST_RECENT = 8


@dataclass(frozen=True)
class RecentBrain:
    """A brain that was opened, as it was asked for."""

    name: str
    unit: Unit | None  # None: it was found out
    voxel_size_um: tuple[float, float, float] | None

    @classmethod
    def of(cls, brain: BrainInput) -> RecentBrain:
        """Return what is remembered of a brain."""
        is_stated = brain.unit_known_by == "stated by the user"
        is_file = brain.name not in template_labels()
        name = str(Path(brain.path)) if is_file else brain.name
        return cls(name, brain.unit if is_stated else None, brain.voxel_size_um)

    @property
    def is_there(self) -> bool:
        """Tell whether it can still be opened."""
        return self.name in template_labels() or Path(self.name).is_file()

    @property
    def short_name(self) -> str:
        """The name without folders."""
        return Path(self.name).name


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
    def recent_pairs(self) -> list[tuple[RecentBrain, RecentBrain]]:
        """Sources and targets that can still be opened, the last used first."""
        try:
            entries = json.loads(str(self._settings.value("recent_pairs", "[]")))
            pairs = [tuple(_recent_brain(entry) for entry in pair) for pair in entries]
        except (TypeError, ValueError, KeyError, AttributeError):  # changed by hand
            return []
        return [
            (pair[0], pair[1]) for pair in pairs if len(pair) == 2 and all(b.is_there for b in pair)
        ]

    def add_recent_pair(self, source: BrainInput, target: BrainInput) -> None:
        """Put a pair of brains first."""
        pair = (RecentBrain.of(source), RecentBrain.of(target))
        pairs = list(dict.fromkeys([pair, *self.recent_pairs]))[:MOST_RECENT]
        text = json.dumps([[asdict(brain) for brain in both] for both in pairs])
        self._settings.setValue("recent_pairs", text)

    @property
    def scheme(self) -> Scheme:
        """Whether the window is light, dark, or as the system is."""
        value = str(self._settings.value("theme", "system"))
        schemes: tuple[Scheme, ...] = ("light", "dark")
        return next((scheme for scheme in schemes if scheme == value), "system")

    @scheme.setter
    def scheme(self, scheme: Scheme) -> None:
        self._settings.setValue("theme", scheme)

    @property
    def autosave_seconds(self) -> int:
        """How long a change may wait until it is kept for recovery."""
        try:
            return max(
                int(float(str(self._settings.value("autosave_seconds", DEFAULT_SECONDS)))), 1
            )
        except ValueError:
            return DEFAULT_SECONDS

    @autosave_seconds.setter
    def autosave_seconds(self, seconds: int) -> None:
        self._settings.setValue("autosave_seconds", seconds)

    @property
    def keys(self) -> dict[str, list[str]]:
        """The keys of actions, by name, where they are not the usual ones."""
        try:
            changed = json.loads(str(self._settings.value("keys", "{}")))
        except ValueError:
            return {}
        if not isinstance(changed, dict):
            return {}
        return {
            str(name): [str(key) for key in keys]
            for name, keys in changed.items()
            if isinstance(keys, list)
        }

    @keys.setter
    def keys(self, keys: dict[str, Sequence[str]]) -> None:
        self._settings.setValue("keys", json.dumps({name: list(k) for name, k in keys.items()}))

    @property
    def has_toured(self) -> bool:
        """Whether the tour was offered once."""
        return str(self._settings.value("toured", "false")).lower() == "true"

    @has_toured.setter
    def has_toured(self, toured: bool) -> None:
        self._settings.setValue("toured", toured)

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


def _recent_brain(entry: dict[str, object]) -> RecentBrain:
    unit, size = entry["unit"], entry["voxel_size_um"]
    edges = tuple(float(edge) for edge in size) if isinstance(size, list) else ()
    return RecentBrain(
        str(entry["name"]),
        unit if unit in get_args(Unit) else None,  # type: ignore[arg-type]
        (edges[0], edges[1], edges[2]) if len(edges) == 3 else None,
    )
