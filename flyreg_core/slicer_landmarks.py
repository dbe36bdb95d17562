"""Landmarks of 3D Slicer: markups, a form of JSON as BigWarp has another, and the older .fcsv."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from flyreg_core.errors import LandmarkError
from flyreg_core.files import write_atomically
from flyreg_core.named_pairs import NamedPair, Point, Role, Row, end_of, one_ended, parse_point

SLICER_SCHEMA = (
    "https://raw.githubusercontent.com/Slicer/Slicer/main/Modules/Loadable/Markups/Resources/"
    "Schema/markups-schema-v1.0.3.json#"
)
FCSV_COLUMNS = ["id", "x", "y", "z", "ow", "ox", "oy", "oz", "vis", "sel", "lock", "label"]
"""What a row of an .fcsv file begins with if no comment says otherwise."""


def read_json(text: str, path: Path, role: Role) -> list[Row]:
    """Read a .json file of Slicer or BigWarp."""
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


def read_fcsv(text: str, path: Path, role: Role) -> list[Row]:
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
        point = parse_point([cells.get(axis) for axis in "xyz"], f"{path}, {place}")
        name = (cells.get("label") or cells.get("id") or f"F-{len(rows) + 1}").strip()
        pair = one_ended(name, _as_lps(point, is_ras), role, cells.get("sel", "1") != "0")
        rows.append((place, pair))
    return rows


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
            "position": list(end_of(pair, role) or (0.0, 0.0, 0.0)),
            "selected": pair.is_active,
            "positionStatus": "defined" if end_of(pair, role) else "undefined",
        }
        for number, pair in enumerate(pairs, start=1)
    ]
    markup = {"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": points}
    content = {"@schema": SLICER_SCHEMA, "markups": [markup]}
    write_atomically(path, json.dumps(content, indent=2, ensure_ascii=False) + "\n")


def _as_lps(point: Point | None, is_ras: bool) -> Point | None:
    """Return a point in the frame in which Slicer shows meshes."""
    return (-point[0], -point[1], point[2]) if point and is_ras else point


def _read_slicer(content: dict[str, Any], path: Path, role: Role) -> list[Row]:
    rows: list[Row] = []
    for markup in content["markups"]:
        is_ras = markup.get("coordinateSystem", "LPS") in ("RAS", "0", 0)
        for point in markup["controlPoints"]:
            place = f"point {len(rows) + 1}"
            is_placed = point.get("positionStatus", "defined") == "defined"
            position = parse_point(point["position"], f"{path}, {place}") if is_placed else None
            name = str(point.get("label") or point.get("id") or f"F-{len(rows) + 1}").strip()
            is_active = bool(point.get("selected", True))
            rows.append((place, one_ended(name, _as_lps(position, is_ras), role, is_active)))
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
        moving, fixed = (parse_point(end, f"{path}, {place}") for end in (source, target))
        rows.append((place, NamedPair(str(name).strip(), moving, fixed, bool(is_active))))
    return rows
