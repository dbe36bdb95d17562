"""Landmarks as tables of text: BigWarp, OpenSim Creator and flybrains."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from flyreg_core.errors import LandmarkError
from flyreg_core.files import write_atomically
from flyreg_core.named_pairs import (
    UNSET,
    NamedPair,
    Role,
    Row,
    end_of,
    one_ended,
    parse_number,
    parse_point,
)

LAYOUTS = {
    8: "name, active, source x, y, z, target x, y, z (BigWarp)",
    7: "name, source x, y, z, target x, y, z (OpenSim Creator)",
    6: "source x, y, z, target x, y, z (flybrains)",
    4: "name, x, y, z (OpenSim Creator, one brain)",
}
"""What the columns of a CSV file are, by their number."""
OPENSIM_PAIRS = ["name", "source.x", "source.y", "source.z", "dest.x", "dest.y", "dest.z"]
OPENSIM_POINTS = ["name", "x", "y", "z"]
"""The headers that OpenSim Creator writes."""


def read_table(text: str, path: Path, role: Role) -> list[Row]:
    """Read comma-separated text in one of `LAYOUTS`, with or without header."""
    rows = [
        (f"row {number}", [cell.strip() for cell in cells])
        for number, cells in enumerate(csv.reader(io.StringIO(text, newline="")), start=1)
        if any(cell.strip() for cell in cells)
    ]
    if rows and _is_header(rows[0][1]):
        rows = rows[1:]
    if not rows:
        return []
    columns = len(rows[0][1])
    if columns not in LAYOUTS or (columns == 6 and _is_flag(rows[0][1][1])):
        flat = "; two-dimensional BigWarp landmarks are not read" if columns == 6 else ""
        raise LandmarkError(
            f"{path}, {rows[0][0]}: {columns} columns are not expected{flat}; a landmark file has "
            + ", or ".join(f"{count}: {meaning}" for count, meaning in LAYOUTS.items())
        )
    for place, cells in rows:
        if len(cells) != columns:
            raise LandmarkError(
                f"{path}, {place}: {len(cells)} columns instead of {columns}; correct the row or "
                "delete it"
            )
    return [
        (place, _pair(cells, index, role, f"{path}, {place}"))
        for index, (place, cells) in enumerate(rows)
    ]


def write_bigwarp(path: Path, pairs: Iterable[NamedPair]) -> None:
    """Write pairs as BigWarp reads them: moving is the source, fixed the target.

    Weights have no place in this format; an inactive pair stays inactive.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, quoting=csv.QUOTE_ALL, lineterminator="\n")
    for pair in pairs:
        coordinates = (*(pair.source or UNSET), *(pair.target or UNSET))
        cells = ("Infinity" if math.isinf(x) else repr(float(x)) for x in coordinates)
        writer.writerow([pair.name, str(pair.is_active).lower(), *cells])
    write_atomically(path, text.getvalue())


def write_opensim_pairs(path: Path, pairs: Iterable[NamedPair]) -> None:
    """Write pairs that are placed on both brains as OpenSim Creator does; others have no place there.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    rows = [
        [pair.name, *pair.source, *pair.target] for pair in pairs if pair.source and pair.target
    ]
    _write_with_header(path, OPENSIM_PAIRS, rows)


def write_opensim_points(path: Path, pairs: Iterable[NamedPair], role: Role) -> None:
    """Write the points of one brain as OpenSim Creator does; what is not placed has no place there.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    ends = [(pair.name, end_of(pair, role)) for pair in pairs]
    _write_with_header(path, OPENSIM_POINTS, [[name, *end] for name, end in ends if end])


def _write_with_header(path: Path, header: list[str], rows: Iterable[Sequence[object]]) -> None:
    text = io.StringIO()
    text.write(",".join(header) + "\n")
    csv.writer(text, quoting=csv.QUOTE_NONNUMERIC, lineterminator="\n").writerows(rows)
    write_atomically(path, text.getvalue())


def _pair(cells: Sequence[str], index: int, role: Role, place: str) -> NamedPair:
    """Return the landmark in a row whose number of columns is known to be one of `LAYOUTS`."""
    name, is_active = f"Pt-{index}", True
    if len(cells) != 6:
        name, *cells = cells
        if not name:
            raise LandmarkError(f"{place}: the name is blank; give it one or delete the row")
    if len(cells) == 7:
        flag, *cells = cells
        if not _is_flag(flag):
            raise LandmarkError(f'{place}: "{flag}" must be true or false')
        is_active = flag.lower() == "true"
    points = [parse_point(cells[start : start + 3], place) for start in range(0, len(cells), 3)]
    if len(points) == 1:
        return one_ended(name, points[0], role, is_active)
    return NamedPair(name, points[0], points[1], is_active)


def _is_flag(cell: str) -> bool:
    return cell.lower() in ("true", "false")


def _is_header(cells: Sequence[str]) -> bool:
    """Tell whether no cell beside the name and the flag is a number, even a bad one."""
    values = [cell for cell in cells[1:] if not _is_flag(cell)]
    return len(values) == len(cells) - 1 and all(
        cell and cell.lower() != "nan" and math.isnan(parse_number(cell)) for cell in values
    )
