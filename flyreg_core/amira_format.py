"""Amira surfaces (.surf, HyperSurface): the patches between regions, as text or as bytes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flyreg_core.errors import InputError
from flyreg_core.mesh import Floats, Integers

OUTSIDE = ("", "exterior", "outside")
"""Names, in small letters, of what lies around all other regions."""


@dataclass(frozen=True, eq=False)
class _Patch:
    inner: str
    outer: str
    faces: Integers  # (m, 3), counter-clockwise seen from the outer region


def decode(content: bytes, path: Path) -> tuple[Floats, Integers]:
    """Return all vertices, and the faces between a region and the exterior, seen from there.

    Parameters
    ----------
    path : Path
        Its place, for messages.

    Raises
    ------
    InputError
        No patch borders the exterior.
    ValueError
        The file is damaged or cut short.
    """
    vertices, patches = _read(content)
    outer = [
        patch.faces[:, ::-1] if patch.inner in OUTSIDE else patch.faces
        for patch in patches
        if (patch.inner in OUTSIDE) != (patch.outer in OUTSIDE)
    ]
    if not outer:
        regions = sorted({name for patch in patches for name in (patch.inner, patch.outer)})
        raise InputError(
            f"{path} has no patch that borders the exterior; its regions are "
            f"{', '.join(regions) or 'none'}; save it again with its exterior"
        )
    return vertices, np.concatenate(outer) - 1


def decode_regions(content: bytes) -> tuple[Floats, dict[str, Integers]]:
    """Return all vertices, and by region's name the faces around it, seen from outside.

    Raises
    ------
    ValueError
        The file is damaged or cut short.
    """
    vertices, patches = _read(content)
    faces: dict[str, list[Integers]] = {}
    for patch in patches:
        faces.setdefault(patch.inner, []).append(patch.faces - 1)
        faces.setdefault(patch.outer, []).append(patch.faces[:, ::-1] - 1)
    return vertices, {
        name: np.concatenate(parts) for name, parts in faces.items() if name not in OUTSIDE
    }


def _read(content: bytes) -> tuple[Floats, list[_Patch]]:
    reader = _Reader(content)
    vertices = reader.floats(reader.seek("Vertices"))
    return vertices, [_read_patch(reader) for _ in range(reader.seek("Patches"))]


def _read_patch(reader: _Reader) -> _Patch:
    names = {"InnerRegion": "", "OuterRegion": ""}
    while (words := reader.line()) and words[0] != "Triangles":
        if words[0] in names:
            names[words[0]] = " ".join(words[1:]).strip('"').lower()
    if not words:
        raise ValueError("a patch has no triangles")
    faces = reader.integers(int(words[1]))
    return _Patch(names["InnerRegion"], names["OuterRegion"], faces)


class _Reader:
    """Walks through a file whose lines say how many numbers follow, as text or as bytes."""

    def __init__(self, content: bytes) -> None:
        self._content, self._position = content, 0
        kind = re.match(rb"#\s*HyperSurface[^\n]*?(ASCII|BINARY(-LITTLE-ENDIAN)?)", content, re.I)
        if kind is None:
            raise ValueError("its first line names neither ASCII nor BINARY")
        self._is_text = kind[1].upper() == b"ASCII"
        self._is_big_endian = kind[2] is None

    def lines(self) -> Iterator[list[str]]:
        """Yield the words of the lines to come that are not blank."""
        while self._position < len(self._content):
            end = self._content.find(b"\n", self._position)
            end = len(self._content) if end < 0 else end + 1
            words = self._content[self._position : end].decode("latin-1").split()
            self._position = end
            if words:
                yield words

    def line(self) -> list[str]:
        """Return the words of the next line that is not blank; none at the end."""
        return next(self.lines(), [])

    def seek(self, keyword: str) -> int:
        """Return the number after a keyword that starts a line; what comes before is left out."""
        for words in self.lines():
            if words[0] == keyword and len(words) == 2 and words[1].isdigit():
                return int(words[1])
        raise ValueError(f"it has no line with {keyword} and their number")

    def floats(self, count: int) -> Floats:
        """Return the next (count, 3) coordinates."""
        values = self._numbers(3 * count, ">f4" if self._is_big_endian else "<f4")
        return values.astype(np.float64).reshape(count, 3)

    def integers(self, count: int) -> Integers:
        """Return the next (count, 3) numbers of vertices, which count from 1."""
        values = self._numbers(3 * count, ">i4" if self._is_big_endian else "<i4")
        return values.astype(np.int64).reshape(count, 3)

    def _numbers(self, wanted: int, kind: str) -> NDArray[Any]:
        if self._is_text:
            values, self._position = self._text_numbers(wanted)
            return values
        binary = np.frombuffer(self._content, kind, wanted, self._position)
        self._position += binary.nbytes
        return binary

    def _text_numbers(self, wanted: int) -> tuple[Floats, int]:
        """Return numbers up to the next line that starts with a word, and where that begins."""
        end = re.compile(rb"\n[ \t]*[A-Za-z{}]").search(self._content, max(self._position - 1, 0))
        stop = end.start() if end else len(self._content)
        values = np.array(self._content[self._position : stop].split(), dtype=np.float64)
        if len(values) < wanted:
            raise ValueError(f"{wanted:,} numbers are promised and {len(values):,} are there")
        return values[:wanted], stop
