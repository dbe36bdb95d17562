"""Landmark files of other programs: BigWarp, 3D Slicer, OpenSim Creator, Fiji, flybrains.

Files with pairs (BigWarp, OpenSim Creator, flybrains) give both ends of each landmark. Slicer, Fiji
and OpenSim Creator also write one file for each brain; such a file gives one end only, and `joined`
puts those of two brains together by name, as OpenSim Creator does.

Coordinates are in the unit and frame of the brain's mesh file. Slicer shows meshes as LPS, so
points that it saved as RAS are turned to LPS (x and y negated); its own unit label is ignored,
because it takes every mesh for millimetres.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree

from flyreg_core.errors import LandmarkError
from flyreg_core.files import read_text, write_atomically
from flyreg_core.landmarks import LandmarkPair

Point = tuple[float, float, float]
Role = Literal["source", "target"]

SLICER_SCHEMA = (
    "https://raw.githubusercontent.com/Slicer/Slicer/main/Modules/Loadable/Markups/Resources/"
    "Schema/markups-schema-v1.0.3.json#"
)
FCSV_COLUMNS = ["id", "x", "y", "z", "ow", "ox", "oy", "oz", "vis", "sel", "lock", "label"]
"""What a row of an .fcsv file begins with if no comment says otherwise."""
UNSET = (math.inf, math.inf, math.inf)
"""How BigWarp writes a point that has not been placed."""
LAYOUTS = {
    8: "name, active, source x, y, z, target x, y, z (BigWarp)",
    7: "name, source x, y, z, target x, y, z (OpenSim Creator)",
    6: "source x, y, z, target x, y, z (flybrains)",
    4: "name, x, y, z (OpenSim Creator, one brain)",
}
"""What the columns of a CSV file are, by their number."""


@dataclass(frozen=True)
class NamedPair:
    """One landmark of a file, in the file's units; None where an end is not placed."""

    name: str
    source: Point | None
    target: Point | None
    is_active: bool = True


def read_landmark_pairs(path: Path, role: Role = "source") -> tuple[NamedPair, ...]:
    """Return the landmarks of a file; the format follows from the ending and the columns.

    Parameters
    ----------
    path : Path
        A .csv or .txt file in one of `LAYOUTS`, with or without header; a .json file of Slicer or
        BigWarp; a .fcsv file of Slicer; a .points file of Fiji.
    role : {"source", "target"}
        Which brain the points belong to if the file holds points of one brain.

    Raises
    ------
    InputError
        The file is missing, empty or not text.
    LandmarkError
        The ending is unknown, a row is damaged or repeats a name, or no landmark is in the file.
    """
    readers = {
        **dict.fromkeys((".csv", ".txt"), _read_csv),
        **{".json": _read_json, ".fcsv": _read_fcsv, ".points": _read_fiji},
    }
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise LandmarkError(
            f"{path} has the unknown ending {path.suffix or '(none)'}; landmarks are read from "
            f"{', '.join(readers)}"
        )
    rows = reader(read_text(path), path, role)
    usable = [pair for _, pair in rows if pair.source or pair.target]
    if not usable:
        raise LandmarkError(f"{path} holds no landmark that is placed; choose another file")
    seen: dict[str, str] = {}
    for place, pair in rows:
        if pair.name in seen:
            raise LandmarkError(
                f"{path}, {place}: the name {pair.name} is used in {seen[pair.name]} already; "
                "rename one of them"
            )
        seen[pair.name] = place
    return tuple(pair for _, pair in rows)


def read_template(path: Path) -> tuple[str, ...]:
    """Return the names of landmarks that are to be placed, one on each line or in a first column.

    Lines that start with # are comments; what follows a comma is left out.

    Raises
    ------
    InputError
        The file is missing, empty or not text.
    LandmarkError
        It has no name, or one twice.
    """
    rows = csv.reader(io.StringIO(read_text(path)))
    names = [row[0].strip() for row in rows if row and row[0].strip()[:1] not in ("", "#")]
    if not names:
        raise LandmarkError(f"{path} has no names of landmarks; write one on each line")
    if twice := [name for name in dict.fromkeys(names) if names.count(name) > 1]:
        raise LandmarkError(f"{path} has the name {twice[0]} twice; rename one of them")
    return tuple(names)


def joined(source: Iterable[NamedPair], target: Iterable[NamedPair]) -> tuple[NamedPair, ...]:
    """Return landmarks of two brains put together by name, those of the target alone at the end."""
    ends = {pair.name: pair for pair in target}
    pairs = [_with_target(pair, ends.pop(pair.name, None)) for pair in source]
    return (*pairs, *ends.values())


def to_landmark_pairs(
    named: Iterable[NamedPair], source_um_per_unit: float, target_um_per_unit: float
) -> tuple[LandmarkPair, ...]:
    """Return landmarks of a file as interior pairs of a project, in micrometres.

    An inactive one gets weight 0; the id follows from the name, so that reading a file again
    gives the same ids.
    """
    return tuple(
        LandmarkPair(
            id=f"user-{pair.name}",
            name=pair.name,
            kind="interior",
            half=None,
            source=_scaled(pair.source, source_um_per_unit),
            target=_scaled(pair.target, target_um_per_unit),
            weight=1.0 if pair.is_active else 0.0,
        )
        for pair in named
    )


def to_named_pairs(
    pairs: Iterable[LandmarkPair], source_um_per_unit: float, target_um_per_unit: float
) -> tuple[NamedPair, ...]:
    """Return the interior pairs of a project in the units of the files; the others are left out."""
    return tuple(
        NamedPair(
            pair.name,
            _scaled(pair.source, 1 / source_um_per_unit),
            _scaled(pair.target, 1 / target_um_per_unit),
            is_active=pair.weight > 0,
        )
        for pair in pairs
        if pair.kind == "interior"
    )


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


def write_slicer(path: Path, pairs: Iterable[NamedPair], role: Role) -> None:
    """Write the points of one brain as a Slicer markups file (.mrk.json).

    Raises
    ------
    InputError
        The file cannot be written.
    """
    points = [
        {
            "id": str(number),
            "label": pair.name,
            "position": list(getattr(pair, role) or (0.0, 0.0, 0.0)),
            "selected": pair.is_active,
            "positionStatus": "defined" if getattr(pair, role) else "undefined",
        }
        for number, pair in enumerate(pairs, start=1)
    ]
    markup = {"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": points}
    content = {"@schema": SLICER_SCHEMA, "markups": [markup]}
    write_atomically(path, json.dumps(content, indent=2, ensure_ascii=False) + "\n")


Row = tuple[str, NamedPair]
"""Where a landmark stands in the file, and the landmark."""


def _scaled(place: object, factor: float) -> Point | None:
    if not isinstance(place, tuple):
        return None
    x, y, z = place
    return (x * factor, y * factor, z * factor)


def _one_ended(name: str, point: Point | None, role: Role, is_active: bool) -> NamedPair:
    ends: dict[str, Any] = {"source": None, "target": None, role: point}
    return NamedPair(name, is_active=is_active, **ends)


def _with_target(pair: NamedPair, end: NamedPair | None) -> NamedPair:
    if end is None:
        return pair
    return replace(pair, target=end.target, is_active=pair.is_active and end.is_active)


def _read_csv(text: str, path: Path, role: Role) -> list[Row]:
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
    points = [_point(cells[start : start + 3], place) for start in range(0, len(cells), 3)]
    if len(points) == 1:
        return _one_ended(name, points[0], role, is_active)
    return NamedPair(name, points[0], points[1], is_active)


def _point(cells: Iterable[object], place: str) -> Point | None:
    x, y, z = (_number(cell, place) for cell in cells)
    if (abs(x), abs(y), abs(z)) == UNSET:
        return None
    if math.inf in (abs(x), abs(y), abs(z)):
        raise LandmarkError(f"{place}: only a part of a point is infinite; place it or unset it")
    return (x, y, z)


def _number(cell: object, place: str) -> float:
    if cell is None or not str(cell).strip():
        raise LandmarkError(f"{place}: a coordinate is blank; fill it in or delete the row")
    number = _parsed(cell)
    if math.isnan(number):
        raise LandmarkError(f'{place}: "{cell}" is not a number; correct it or delete the row')
    return number


def _parsed(cell: object) -> float:
    try:
        return float(str(cell))
    except ValueError:
        return math.nan


def _is_flag(cell: str) -> bool:
    return cell.lower() in ("true", "false")


def _is_header(cells: Sequence[str]) -> bool:
    """Tell whether no cell beside the name and the flag is a number, even a bad one."""
    values = [cell for cell in cells[1:] if not _is_flag(cell)]
    return len(values) == len(cells) - 1 and all(
        cell and cell.lower() != "nan" and math.isnan(_parsed(cell)) for cell in values
    )


def _read_fcsv(text: str, path: Path, role: Role) -> list[Row]:
    """Read Slicer's older format: a comment names the columns, and may be behind their number."""
    columns = FCSV_COLUMNS
    is_ras = True  # what files of before this was written down are in
    rows: list[Row] = []
    for number, line in enumerate(text.splitlines(), start=1):
        key, _, value = line.lstrip("# ").partition("=")
        if line.startswith("#"):
            if key.strip() == "CoordinateSystem":
                is_ras = value.strip() in ("RAS", "0")
            elif key.strip() == "columns":
                columns = [column.strip() for column in value.split(",")]
            continue
        if not line.strip():
            continue
        place = f"row {number}"
        cells = dict(zip(columns, next(csv.reader([line])), strict=False))
        point = _point([cells.get(axis) for axis in "xyz"], f"{path}, {place}")
        name = (cells.get("label") or cells.get("id") or f"F-{len(rows) + 1}").strip()
        pair = _one_ended(name, _as_lps(point, is_ras), role, cells.get("sel", "1") != "0")
        rows.append((place, pair))
    return rows


def _as_lps(point: Point | None, is_ras: bool) -> Point | None:
    return (-point[0], -point[1], point[2]) if point and is_ras else point


def _read_fiji(text: str, path: Path, role: Role) -> list[Row]:
    """Read what Fiji's Name Landmarks writes: names that are placed or not, in the world's units."""
    try:
        named = list(ElementTree.fromstring(text).iter("pointworld"))
    except ElementTree.ParseError as error:
        raise LandmarkError(f"{path} is damaged ({error}); export it again") from error
    rows: list[Row] = []
    for number, point in enumerate(named, start=1):
        place, cells = f"point {number}", [point.get(axis) for axis in "xyz"]
        position = _point(cells, f"{path}, {place}") if point.get("set") != "false" else None
        name = (point.get("name") or f"F-{number}").strip()
        rows.append((place, _one_ended(name, position, role, True)))
    return rows


def _read_json(text: str, path: Path, role: Role) -> list[Row]:
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise LandmarkError(f"{path} is damaged ({error}); export it again") from error
    try:
        if "markups" in content:
            return _read_slicer(content, path, role)
        return _read_bigwarp_json(content.get("landmarks", content), path)
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        raise LandmarkError(
            f"{path} is neither a Slicer markups file nor a BigWarp landmark file, or is damaged "
            f"({type(error).__name__}: {error}); export it again"
        ) from error


def _read_slicer(content: dict[str, Any], path: Path, role: Role) -> list[Row]:
    rows: list[Row] = []
    for markup in content["markups"]:
        is_ras = markup.get("coordinateSystem", "LPS") in ("RAS", "0", 0)
        for point in markup["controlPoints"]:
            place = f"point {len(rows) + 1}"
            is_placed = point.get("positionStatus", "defined") == "defined"
            position = _point(point["position"], f"{path}, {place}") if is_placed else None
            name = str(point.get("label") or point.get("id") or f"F-{len(rows) + 1}").strip()
            is_active = bool(point.get("selected", True))
            rows.append((place, _one_ended(name, _as_lps(position, is_ras), role, is_active)))
    return rows


def _read_bigwarp_json(content: dict[str, Any], path: Path) -> list[Row]:
    if content["numDimensions"] != 3:
        raise LandmarkError(
            f"{path} holds landmarks in {content['numDimensions']} dimensions, not 3"
        )
    columns = (content[key] for key in ("names", "active", "movingPoints", "fixedPoints"))
    rows: list[Row] = []
    for name, is_active, source, target in zip(*columns, strict=True):
        place = f"point {len(rows) + 1}"
        moving, fixed = (_point(end, f"{path}, {place}") for end in (source, target))
        rows.append((place, NamedPair(str(name).strip(), moving, fixed, bool(is_active))))
    return rows
