"""Legacy VTK files (.vtk), without VTK: polygonal surfaces and unstructured grids of polygons."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flyreg_core.errors import InputError
from flyreg_core.mesh import Floats, Integers

TYPES = {
    "char": "i1",
    "unsigned_char": "u1",
    "bit": "u1",
    "short": ">i2",
    "unsigned_short": ">u2",
    "int": ">i4",
    "unsigned_int": ">u4",
    "long": ">i8",
    "unsigned_long": ">u8",
    "vtkidtype": ">i8",
    "vtktypeint64": ">i8",
    "float": ">f4",
    "double": ">f8",
}
"""The format's number types as numpy types; binary files are big-endian."""
CELLS = ("VERTICES", "LINES", "POLYGONS", "CELLS")
"""Sections of the same layout; only the last two hold faces."""
FLAT_CELLS = (5, 7, 9)
"""Triangle, polygon and quadrilateral among the cell types of unstructured grids."""


def triangles(polygons: Iterable[list[int]]) -> Integers:
    """Return polygons as a fan of triangles each; those with fewer than 3 corners are left out."""
    fans = [(p[0], p[i], p[i + 1]) for p in polygons for i in range(1, len(p) - 1)]
    return np.array(fans, dtype=np.int64).reshape(-1, 3)


def decode(content: bytes, path: Path) -> tuple[Floats, Integers]:
    """Return vertices and faces of a legacy VTK file; points, lines and volumes are left out.

    Parameters
    ----------
    path : Path
        Its place, for messages.

    Raises
    ------
    InputError
        The file holds triangle strips, or an image instead of a surface.
    ValueError, IndexError, KeyError
        The file is damaged or cut short.
    """
    reader = _Reader(content)
    vertices = np.zeros((0, 3))
    polygons: list[list[int]] = []
    while words := reader.line():
        match words:
            case ["DATASET", kind] if kind not in ("POLYDATA", "UNSTRUCTURED_GRID"):
                raise InputError(f"{path} is no surface but {kind}; save the surface as PLY")
            case ["TRIANGLE_STRIPS", *_]:
                raise InputError(f"{path} has triangle strips; save it as PLY, with triangles")
            case ["POINTS", count, kind]:
                vertices = reader.numbers(kind, 3 * int(count)).astype(np.float64).reshape(-1, 3)
            case [section, count, size] if section in CELLS:
                cells = reader.cells(int(count), int(size))
                polygons += cells if section in CELLS[2:] else []
            case ["CELL_TYPES", count]:
                types = reader.numbers("int", int(count)).tolist()
                typed = zip(polygons, types, strict=True)
                polygons = [corners for corners, cell in typed if cell in FLAT_CELLS]
            case ["FIELD", _, count]:
                reader.skip_arrays(int(count))
            case ["METADATA"]:
                reader.skip_to_blank_line()
            case ["POINT_DATA" | "CELL_DATA", *_]:
                break
    return vertices, triangles(polygons)


class _Reader:
    """Walks through a file whose lines say how many numbers follow, as text or as bytes."""

    def __init__(self, content: bytes) -> None:
        self._content, self._position = content, 0
        self._version = float(self.raw_line().split()[-1])
        self.raw_line()  # the title, free text
        self._is_text = self.raw_line().strip().upper() == b"ASCII"

    def raw_line(self) -> bytes:
        """Return what is left of this line."""
        start = self._position
        end = self._content.find(b"\n", start)
        self._position = len(self._content) if end < 0 else end + 1
        return self._content[start : self._position]

    def line(self) -> list[str]:
        """Return the words of the next line that is not blank; none at the end."""
        while self._position < len(self._content):
            if words := self.raw_line().decode("latin-1").split():
                return words
        return []

    def numbers(self, kind: str, count: int) -> NDArray[Any]:
        """Return the next numbers of a named type."""
        dtype = np.dtype(TYPES[kind.lower()])
        if not self._is_text:
            values = np.frombuffer(self._content, dtype, count, self._position)
            self._position += values.nbytes
            return values
        words: list[bytes] = []
        while len(words) < count:
            if self._position >= len(self._content):
                raise ValueError(f"{count} numbers are promised and {len(words)} are there")
            words += self.raw_line().split()
        return np.array(words[:count]).astype(dtype)

    def skip_arrays(self, count: int) -> None:
        """Pass over the arrays of a field."""
        for _ in range(count):
            _, components, tuples, kind = self.line()
            self.numbers(kind, int(components) * int(tuples))

    def skip_to_blank_line(self) -> None:
        """Pass over a block that a blank line ends."""
        while self.raw_line().strip():
            pass

    def cells(self, count: int, size: int) -> list[list[int]]:
        """Return the corners of each cell, in the layout of the file's version."""
        if self._version < 5:  # each cell's number of corners, then its corners
            flat, starts = self.numbers("int", size).tolist(), [0]
            for _ in range(count):
                starts.append(starts[-1] + flat[starts[-1]] + 1)
            return [flat[a + 1 : b] for a, b in pairwise(starts)]
        _, kind = self.line()  # OFFSETS type; their count is one more than the cells'
        offsets = self.numbers(kind, count).tolist()
        _, kind = self.line()  # CONNECTIVITY type
        corners = self.numbers(kind, size).tolist()
        return [corners[a:b] for a, b in pairwise(offsets)]


def encode(vertices: Floats, faces: Integers, properties: Mapping[str, NDArray[Any]]) -> bytes:
    """Return a binary polygonal surface, coordinates in double precision."""
    counted = np.column_stack([np.full(len(faces), 3), faces]).astype(">i4")
    parts = [
        b"# vtk DataFile Version 3.0\nflyreg\nBINARY\nDATASET POLYDATA\n",
        f"POINTS {len(vertices)} double\n".encode(),
        vertices.astype(">f8").tobytes(),
        f"\nPOLYGONS {len(faces)} {counted.size}\n".encode(),
        counted.tobytes(),
    ]
    if properties:
        parts.append(f"\nPOINT_DATA {len(vertices)}".encode())
    for name, values in properties.items():
        parts.append(f"\nSCALARS {name} double 1\nLOOKUP_TABLE default\n".encode())
        parts.append(values.astype(">f8").tobytes())
    return b"".join([*parts, b"\n"])
