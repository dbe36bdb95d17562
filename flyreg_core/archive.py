"""Nested values of the engine in one file and back: no code is ever run from it."""

from __future__ import annotations

import dataclasses
import importlib
import json
from collections.abc import Mapping
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

TREE = "tree"
"""The name under which the file keeps what is not an array."""
PACKAGE = "flyreg_core."


class ArchiveError(Exception):
    """A file is no archive, or one of another version."""


def write_archive(file: BinaryIO, value: object) -> None:
    """Write dataclasses of the engine, arrays, mappings, tuples, and what JSON knows.

    What is shared in the value is written once and is shared again when it is read.
    """
    writer = _Writer()
    root = writer.encoded(value)
    tree = json.dumps({"root": root, "objects": writer.objects}).encode()
    arrays = {f"a{number}": np.asarray(array) for number, array in enumerate(writer.arrays)}
    arrays[TREE] = np.frombuffer(tree, dtype=np.uint8)
    np.savez(file, **arrays)  # type: ignore[arg-type]


def read_archive(file: BinaryIO) -> object:
    """Return the value that was written; its arrays cannot be changed.

    Raises
    ------
    ArchiveError
        The file is not what `write_archive` writes, or its classes have changed since.
    """
    try:
        with np.load(file, allow_pickle=False) as arrays:
            tree = json.loads(arrays[TREE].tobytes())
            return _Reader(tree["objects"], arrays).decoded(tree["root"])
    except Exception as error:  # whatever a damaged file can cause
        raise ArchiveError(f"not an archive, or damaged: {error}") from error


class _Writer:
    def __init__(self) -> None:
        self.objects: list[Any] = []
        self.arrays: list[NDArray[np.generic]] = []
        self._number_of: dict[int, Any] = {}
        self._kept: list[object] = []  # so that no id is used twice

    def encoded(self, value: object) -> Any:
        if value is None or isinstance(value, bool | str):
            return value
        if isinstance(value, np.bool_ | np.integer | np.floating):
            return value.item()
        if isinstance(value, int | float):
            return value
        if id(value) not in self._number_of:
            self._kept.append(value)
            self._number_of[id(value)] = self._added(value)
        return self._number_of[id(value)]

    def _added(self, value: object) -> Any:
        if isinstance(value, np.ndarray):
            self.arrays.append(value)
            return {"array": len(self.arrays) - 1}
        if isinstance(value, tuple | list):
            return {type(value).__name__: [self.encoded(part) for part in value]}
        if isinstance(value, Mapping):
            return {"mapping": [[self.encoded(k), self.encoded(v)] for k, v in value.items()]}
        if not (dataclasses.is_dataclass(value) and type(value).__module__.startswith(PACKAGE)):
            raise TypeError(f"a {type(value).__name__} cannot be kept in an archive")
        parts = {
            each.name: self.encoded(getattr(value, each.name)) for each in dataclasses.fields(value)
        }
        self.objects.append([type(value).__module__, type(value).__qualname__, parts])
        return {"object": len(self.objects) - 1}


class _Reader:
    def __init__(self, objects: list[Any], arrays: Mapping[str, NDArray[np.generic]]) -> None:
        self._objects, self._arrays = objects, arrays
        self._known: dict[tuple[str, int], object] = {}

    def decoded(self, value: Any) -> object:
        if not isinstance(value, dict):
            return value
        ((kind, content),) = value.items()
        if kind in ("tuple", "list"):
            parts = [self.decoded(part) for part in content]
            return tuple(parts) if kind == "tuple" else parts
        if kind == "mapping":
            return {self.decoded(key): self.decoded(part) for key, part in content}
        if (kind, content) not in self._known:
            make = self._array if kind == "array" else self._object
            self._known[kind, content] = make(content)
        return self._known[kind, content]

    def _array(self, number: int) -> NDArray[np.generic]:
        array = self._arrays[f"a{number}"]
        array.setflags(write=False)
        return array

    def _object(self, number: int) -> object:
        module, name, parts = self._objects[number]
        if not module.startswith(PACKAGE):
            raise ArchiveError(f"{module} is not part of the engine")
        made = getattr(importlib.import_module(module), name)
        if {each.name for each in dataclasses.fields(made)} != set(parts):
            raise ArchiveError(f"{name} has other parts now")
        value = object.__new__(made)
        for part, content in parts.items():
            object.__setattr__(value, part, self.decoded(content))
        return value
