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
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from flyreg_core.errors import LandmarkError
from flyreg_core.fiji_landmarks import read_fiji, write_fiji
from flyreg_core.files import read_text
from flyreg_core.landmark_tables import (
    read_table,
    write_bigwarp,
    write_opensim_pairs,
    write_opensim_points,
)
from flyreg_core.landmarks import LandmarkPair
from flyreg_core.named_pairs import NamedPair, Point, Role, end_of
from flyreg_core.slicer_landmarks import read_fcsv, read_json, write_slicer

ROLES: tuple[Role, ...] = ("source", "target")


@dataclass(frozen=True)
class LandmarkFormat:
    """A kind of file that landmarks are written to."""

    title: str  # for the user
    ending: str
    role: Role | None  # whose points it holds; None: pairs
    write: Callable[[Path, Sequence[NamedPair]], None]
    has_gaps: bool = True  # it can say that an end is not placed
    has_flags: bool = True  # it can say that a landmark is not in use

    def holds(self, pair: NamedPair) -> bool:
        """Tell whether a landmark has a place in such a file."""
        ends = ROLES if self.role is None else (self.role,)
        return self.has_gaps or all(end_of(pair, role) is not None for role in ends)


def _for_each_brain(
    program: str,
    ending: str,
    write: Callable[[Path, Sequence[NamedPair], Role], None],
    *,
    has_gaps: bool = True,
    has_flags: bool = True,
) -> tuple[LandmarkFormat, ...]:
    def write_one(role: Role) -> Callable[[Path, Sequence[NamedPair]], None]:
        return lambda path, pairs: write(path, pairs, role)

    return tuple(
        LandmarkFormat(f"{program}, {role}", ending, role, write_one(role), has_gaps, has_flags)
        for role in ROLES
    )


FORMATS = (
    LandmarkFormat("BigWarp, both brains", ".csv", None, write_bigwarp),
    *_for_each_brain("3D Slicer", ".mrk.json", write_slicer),
    LandmarkFormat(
        "OpenSim Creator, both brains",
        ".csv",
        None,
        write_opensim_pairs,
        has_gaps=False,
        has_flags=False,
    ),
    *_for_each_brain(
        "OpenSim Creator", ".csv", write_opensim_points, has_gaps=False, has_flags=False
    ),
    *_for_each_brain("Fiji", ".points", write_fiji, has_flags=False),
)
"""All that can be written; the first is the usual one."""


def read_landmark_pairs(path: Path, role: Role = "source") -> tuple[NamedPair, ...]:
    """Return the landmarks of a file; the format follows from the ending and the columns.

    Parameters
    ----------
    path : Path
        A .csv or .txt file in one of `landmark_tables.LAYOUTS`, with or without header; a .json
        file of Slicer or BigWarp; a .fcsv file of Slicer; a .points file of Fiji.
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
        **dict.fromkeys((".csv", ".txt"), read_table),
        **{".json": read_json, ".fcsv": read_fcsv, ".points": read_fiji},
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


def _scaled(place: object, factor: float) -> Point | None:
    if not isinstance(place, tuple):
        return None
    x, y, z = place
    return (x * factor, y * factor, z * factor)


def _with_target(pair: NamedPair, end: NamedPair | None) -> NamedPair:
    if end is None:
        return pair
    return replace(pair, target=end.target, is_active=pair.is_active and end.is_active)
