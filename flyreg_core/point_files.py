"""Tables of points, as comma-separated text with the columns x, y and z among others."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flyreg_core.errors import InputError
from flyreg_core.files import read_text, write_atomically
from flyreg_core.mesh import Floats
from flyreg_core.transform import TransformedPoints

AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class PointTable:
    """A table as it was read: all columns as text, and the points in them."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    points: Floats  # (n, 3), in the unit of the file


def read_points(path: Path) -> PointTable:
    """Read a table of points.

    Raises
    ------
    InputError
        A column is missing, or a row has a blank, text or an infinite number for a coordinate.
    """
    lines = list(csv.reader(io.StringIO(read_text(path))))
    lines = [line for line in lines if line]
    columns = tuple(name.strip() for name in lines[0]) if lines else ()
    missing = [axis for axis in AXES if axis not in columns]
    if missing:
        raise InputError(
            f"{path} has no column {' and no column '.join(missing)} in its first line; the columns x, y "
            "and z are needed"
        )
    places = [columns.index(axis) for axis in AXES]
    points = np.zeros((len(lines) - 1, 3))
    for number, line in enumerate(lines[1:], 1):
        if len(line) != len(columns):
            raise InputError(f"{path}, row {number}: {len(line)} values for {len(columns)} columns")
        for axis, place in enumerate(places):
            points[number - 1, axis] = _number(
                line[place], f"{path}, row {number}, column {AXES[axis]}"
            )
    return PointTable(columns, tuple(tuple(line) for line in lines[1:]), points)


def _number(text: str, place: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{place}: '{text}' is not a number; fill it in or remove the row")
    return number


def write_points(path: Path, table: PointTable, moved: TransformedPoints, unit_um: float) -> None:
    """Write a table with new coordinates and a column `status`: mapped, or outside and blank.

    Parameters
    ----------
    unit_um : float
        Length of the unit to write in, micrometres.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    others = [place for place, name in enumerate(table.columns) if name not in (*AXES, "status")]
    writer.writerow([*AXES, *(table.columns[place] for place in others), "status"])
    for row, point, is_mapped in zip(
        table.rows, moved.points / unit_um, moved.is_mapped, strict=True
    ):
        coordinates = [repr(float(value)) for value in point] if is_mapped else ["", "", ""]
        status = "mapped" if is_mapped else "outside"
        writer.writerow([*coordinates, *(row[place] for place in others), status])
    write_atomically(path, text.getvalue())
