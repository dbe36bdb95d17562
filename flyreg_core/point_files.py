"""Tables of points, as comma-separated text with the columns x, y and z among others."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flyreg_core.brain_files import UM_PER_UNIT
from flyreg_core.errors import FlyregError, InputError
from flyreg_core.files import read_text, write_atomically
from flyreg_core.landmark_files import read_landmark_pairs
from flyreg_core.mesh import Floats
from flyreg_core.project import Project, Unit
from flyreg_core.transform import TransformedPoints

AXES = ("x", "y", "z")
TARGET_AXES = ("x_target", "y_target", "z_target")


@dataclass(frozen=True, eq=False)
class PointTable:
    """A table as it was read: all columns as text, and the points in them."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    points: Floats  # (n, 3), in the unit of the file


@dataclass(frozen=True, eq=False)
class PointPairs:
    """Points of one brain and where they belong in another."""

    source: Floats  # (n, 3)
    target: Floats  # (n, 3)

    def scaled(self, source_um: float, target_um: float) -> PointPairs:
        """Return the points in micrometres, given the lengths of their units."""
        return PointPairs(source_um * self.source, target_um * self.target)


def read_point_pairs(path: Path) -> PointPairs:
    """Read points of one brain and where they belong in another.

    A table with the columns x, y, z, x_target, y_target and z_target among others; or a landmark
    file with both ends, of which flybrains' has just six columns (`landmark_files`).

    Raises
    ------
    FlyregError
        It is neither, a coordinate is blank or no number, or there is no point.
    """
    lines = [line for line in csv.reader(io.StringIO(read_text(path))) if line]
    columns = [name.strip() for name in lines[0]] if lines else []
    if set(TARGET_AXES) <= set(columns):
        ends = [_table(path, lines, axes).points for axes in (AXES, TARGET_AXES)]
    else:
        try:
            pairs = read_landmark_pairs(path)
        except FlyregError as error:
            raise InputError(
                f"{path} has no columns {', '.join((*AXES, *TARGET_AXES))}, and is no landmark file: "
                f"{error}"
            ) from error
        whole = [pair for pair in pairs if pair.source and pair.target]
        ends = [
            np.array([getattr(pair, role) for pair in whole], dtype=float).reshape(-1, 3)
            for role in ("source", "target")
        ]
    if not len(ends[0]):
        raise InputError(f"{path} holds no point with a place in both brains; choose another file")
    return PointPairs(ends[0], ends[1])


def read_point_pairs_um(path: Path, project: Project, unit: Unit | None = None) -> PointPairs:
    """Read points of the source of a project and where they belong in its target, as micrometres.

    Parameters
    ----------
    unit : str, optional
        Of both ends; usually each has that of the file of its brain.

    Raises
    ------
    FlyregError
        See `read_point_pairs`.
    """
    brains = (project.source.input, project.target.input)
    return read_point_pairs(path).scaled(*(UM_PER_UNIT[unit or brain.unit] for brain in brains))


def read_points(path: Path) -> PointTable:
    """Read a table of points.

    Raises
    ------
    InputError
        A column is missing, or a row has a blank, text or an infinite number for a coordinate.
    """
    lines = [line for line in csv.reader(io.StringIO(read_text(path))) if line]
    return _table(path, lines, AXES)


def _table(path: Path, lines: Sequence[Sequence[str]], axes: Sequence[str]) -> PointTable:
    columns = tuple(name.strip() for name in lines[0]) if lines else ()
    missing = [axis for axis in axes if axis not in columns]
    if missing:
        raise InputError(
            f"{path} has no column {' and no column '.join(missing)} in its first line; the columns "
            f"{', '.join(axes[:-1])} and {axes[-1]} are needed"
        )
    places = [columns.index(axis) for axis in axes]
    points = np.zeros((len(lines) - 1, 3))
    for number, line in enumerate(lines[1:], 1):
        if len(line) != len(columns):
            raise InputError(f"{path}, row {number}: {len(line)} values for {len(columns)} columns")
        for axis, place in enumerate(places):
            points[number - 1, axis] = _number(
                line[place], f"{path}, row {number}, column {axes[axis]}"
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
