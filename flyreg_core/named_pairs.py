"""Landmarks as the files of other programs hold them: names and places, in the units of the files."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

from flyreg_core.errors import LandmarkError

Point = tuple[float, float, float]
Role = Literal["source", "target"]

UNSET = (math.inf, math.inf, math.inf)
"""How BigWarp writes a point that has not been placed."""


@dataclass(frozen=True)
class NamedPair:
    """One landmark of a file, in the file's units; None where an end is not placed."""

    name: str
    source: Point | None
    target: Point | None
    is_active: bool = True


Row = tuple[str, NamedPair]
"""Where a landmark stands in a file, and the landmark."""


def one_ended(name: str, point: Point | None, role: Role, is_active: bool = True) -> NamedPair:
    """Return a landmark of which one end is known, or none."""
    ends: dict[str, Any] = {"source": None, "target": None, role: point}
    return NamedPair(name, is_active=is_active, **ends)


def end_of(pair: NamedPair, role: Role) -> Point | None:
    """Return one end of a landmark."""
    return pair.source if role == "source" else pair.target


def parse_point(cells: Iterable[object], place: str) -> Point | None:
    """Return the point of three cells; None if it is infinite, that is not placed.

    Raises
    ------
    LandmarkError
        A cell is blank or no number; the sentence begins with `place`.
    """
    x, y, z = (_number(cell, place) for cell in cells)
    if (abs(x), abs(y), abs(z)) == UNSET:
        return None
    if math.inf in (abs(x), abs(y), abs(z)):
        raise LandmarkError(f"{place}: only a part of a point is infinite; place it or unset it")
    return (x, y, z)


def _number(cell: object, place: str) -> float:
    if cell is None or not str(cell).strip():
        raise LandmarkError(f"{place}: a coordinate is blank; fill it in or delete the row")
    number = parse_number(cell)
    if math.isnan(number):
        raise LandmarkError(f'{place}: "{cell}" is not a number; correct it or delete the row')
    return number


def parse_number(cell: object) -> float:
    """Return a cell's number, NaN if it is none."""
    try:
        return float(str(cell))
    except ValueError:
        return math.nan
