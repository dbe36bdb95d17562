"""What is in files of points: text with three or more columns, and PLY without faces."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from flyreg_core.errors import InputError
from flyreg_core.mesh import Floats
from flyreg_core.point_cloud import PointCloud

ENDINGS = (".xyz", ".csv", ".tsv", ".txt", ".pts", ".asc")
"""Endings of text files of points."""
COORDINATES, NORMAL = ("x", "y", "z"), ("nx", "ny", "nz")
NEARLY_ONE = 0.01
"""Three further columns without a name are normals if their length is as near to 1."""


def is_point_text(path: Path) -> bool:
    """Tell from the ending whether a file holds points as text."""
    return path.suffix.lower() in ENDINGS


def decode(content: bytes, path: Path) -> PointCloud:
    """Return the points in a text file, in its unit, with their normals if it has them.

    Columns are parted by commas, semicolons, tabs or blanks. A line of names may say which are x,
    y, z, nx, ny and nz; else the first three are coordinates. Lines that start with # or // are
    left out, and so is a first line with nothing but a number of points.

    Raises
    ------
    InputError
        The file is no text, has no points, or a line has no three numbers.
    """
    if b"\0" in content:
        raise InputError(f"{path} is not text, so its points cannot be read; export it again")
    lines = content.decode("utf-8-sig", "replace").splitlines()
    first = next((i for i, line in enumerate(lines) if _is_told(line)), len(lines))
    words = _split(lines[first]) if first < len(lines) else []
    is_named = bool(words) and not _is_number(words[0])
    names = _names(lines[first]) if is_named else []
    table = _table(lines, first + (is_named or len(words) == 1), path)
    if not len(table):
        raise InputError(f"{path} has no points; export it again")
    return _cloud(table, names, path)


def ply_normals(content: bytes) -> Floats | None:
    """Return the (n, 3) normals of the vertices of a PLY file that is known to be whole."""
    import trimesh  # takes long, and few formats need it

    scene = trimesh.load_scene(io.BytesIO(content), file_type="ply", process=False)
    geometry: Any = next(iter(scene.geometry.values()))
    data = geometry.metadata["_ply_raw"]["vertex"]["data"]
    try:
        return np.column_stack([np.asarray(data[name], dtype=float).ravel() for name in NORMAL])
    except (KeyError, IndexError, ValueError):
        return None


def _is_told(line: str) -> bool:
    text = line.strip()
    return bool(text) and not text.startswith(("#", "//"))


def _split(line: str) -> list[str]:
    return [word for word in re.split(r"[,;\s]+", line.strip()) if word]


def _names(line: str) -> list[str]:
    """Return the names of columns in small letters, without a unit in brackets."""
    mark = next((mark for mark in ",;\t" if mark in line), None)
    names = (re.split(r"[(\[]", name)[0] for name in line.strip().split(mark))
    return [name.strip("\"' ").lower() for name in names]


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _table(lines: Sequence[str], start: int, path: Path) -> Floats:
    """Return the numbers from a line on; a line that is not like the others is named."""
    used = [line for line in lines[start:] if _is_told(line)]
    text = "\n".join(used).replace(",", " ").replace(";", " ")
    try:
        return np.loadtxt(io.StringIO(text), ndmin=2, comments=None) if used else np.zeros((0, 3))
    except ValueError:
        width = len(_split(used[0]))
        for number, line in enumerate(lines[start:], start + 1):
            words = _split(line)
            if _is_told(line) and not (len(words) == width and all(map(_is_number, words))):
                raise InputError(
                    f"{path}, line {number}: '{line.strip()[:40]}' is not {width} numbers as in the "
                    "first line; fill it in or remove it"
                ) from None
        raise


def _cloud(table: Floats, names: Sequence[str], path: Path) -> PointCloud:
    if names and len(names) != table.shape[1]:
        raise InputError(
            f"{path} names {len(names)} columns and has {table.shape[1]}; correct its first line"
        )
    if names and not set(COORDINATES) <= set(names):
        raise InputError(
            f"{path} has the columns {', '.join(names[:9])}; the columns x, y and z are needed"
        )
    if table.shape[1] < 3:
        raise InputError(f"{path} has {table.shape[1]} numbers per line; x, y and z are needed")
    if names:
        points = table[:, [names.index(name) for name in COORDINATES]]
        has_normals = set(NORMAL) <= set(names)
        normals = table[:, [names.index(name) for name in NORMAL]] if has_normals else None
        return PointCloud(points, normals)
    further = table[:, 3:6]
    length = np.linalg.norm(further, axis=1)
    has_normals = further.shape[1] == 3 and bool((np.abs(length - 1) < NEARLY_ONE).all())
    return PointCloud(table[:, :3], further if has_normals else None)
