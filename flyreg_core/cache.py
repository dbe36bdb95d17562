"""Prepared brains on disk: what was prepared once need not be prepared again.

Any file of the folder can be deleted at any time, and several programs can use it at once.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
from dataclasses import replace
from functools import cache as remembered
from pathlib import Path

import platformdirs

from flyreg_core.archive import ArchiveError, read_archive, write_archive
from flyreg_core.project import Brain

FOLDER_VARIABLE = "FLYREG_CACHE"
"""Names another folder, or is "off"."""
OFF = "off"
MOST_BYTES = 2 * 2**30
SUFFIX = ".prepared"


class Cache:
    """A folder of archives, the oldest of which make room for new ones."""

    def __init__(self, folder: Path, most_bytes: int = MOST_BYTES) -> None:
        self.folder, self._most_bytes = folder, most_bytes

    def get(self, key: str) -> object | None:
        """Return what is kept under a key; None if it is not, or cannot be read."""
        path = self._path(key)
        try:
            with path.open("rb") as file:
                value = read_archive(file)
            os.utime(path)
        except ArchiveError:
            with contextlib.suppress(OSError):
                path.unlink()
            return None
        except OSError:
            return None
        return value

    def has(self, key: str) -> bool:
        """Tell whether something is kept under a key, which may still be unreadable."""
        return self._path(key).is_file()

    def put(self, key: str, value: object) -> None:
        """Keep a value, whole or not at all; where there is no room or no right, do not."""
        with contextlib.suppress(OSError):
            self.folder.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=self.folder, suffix=".part")
            try:
                with os.fdopen(handle, "wb") as file:
                    write_archive(file, value)
                os.replace(name, self._path(key))
            except BaseException:
                Path(name).unlink(missing_ok=True)
                raise
            self._make_room()

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}{SUFFIX}"

    def _make_room(self) -> None:
        files = []
        for path in self.folder.glob(f"*{SUFFIX}"):
            with contextlib.suppress(OSError):
                known = path.stat()
                files.append((known.st_mtime, known.st_size, path))
        total = sum(size for _, size, _ in files)
        for _, size, path in sorted(files):
            if total <= self._most_bytes:
                break
            with contextlib.suppress(OSError):
                path.unlink()
            total -= size


def open_cache() -> Cache | None:
    """Return the user's cache; None if it is switched off."""
    folder = os.environ.get(FOLDER_VARIABLE, "")
    if folder == OFF:
        return None
    return Cache(Path(folder) if folder else Path(platformdirs.user_cache_dir("flyreg")))


def key_of(*parts: object) -> str:
    """Return the key of what follows from some parameters, by this very version of the engine.

    Brains count by what their file holds, not by where it lies.
    """
    named = [_without_place(part) if isinstance(part, Brain) else part for part in parts]
    return hashlib.sha256(f"{_engine()} {named!r}".encode()).hexdigest()


def _without_place(brain: Brain) -> Brain:
    return replace(brain, input=replace(brain.input, name="", path=""))


@remembered
def _engine() -> str:
    """Return what tells this version of the engine from any other."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()
