"""Neuropils: named surfaces within a brain, near which landmarks are weighted together."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flyreg_core import mesh_formats
from flyreg_core.brain_checks import UM_PER_UNIT
from flyreg_core.brain_files import check_unchanged
from flyreg_core.correspondence import PlacedLandmark
from flyreg_core.errors import InputError
from flyreg_core.files import read_bytes
from flyreg_core.mesh import Booleans, Floats, Integers, SurfaceMesh
from flyreg_core.project import BrainInput, NeuropilFile, Role, Unit
from flyreg_core.topology import compacted


@dataclass(frozen=True, eq=False)
class Neuropil:
    """One region, in the coordinates of a brain."""

    name: str
    role: Role
    surface: SurfaceMesh  # micrometres; need not be closed


def open_neuropils(path: Path, role: Role, unit: Unit) -> NeuropilFile:
    """Return a file of neuropils as a part of a project; its unit is that of the brain's file.

    Raises
    ------
    InputError
        It is no mesh file that can be read.
    """
    if path.suffix.lower() not in mesh_formats.ENDINGS:
        raise InputError(
            f"{path} is no mesh file; neuropils are read from {', '.join(mesh_formats.ENDINGS)}"
        )
    sha256 = hashlib.sha256(read_bytes(path)).hexdigest()
    known_by = f"as the {role} brain"
    file = NeuropilFile(BrainInput(str(path), str(path), sha256, unit, known_by), role)
    read_neuropils(file)
    return file


def read_neuropils(file: NeuropilFile) -> tuple[Neuropil, ...]:
    """Return the neuropils of a file by name; parts without faces are left out.

    Raises
    ------
    InputError
        The file is gone, has changed, or holds no face.
    """
    check_unchanged(file.input)
    path = Path(file.input.path)
    parts = mesh_formats.decode_parts(read_bytes(path), path)
    neuropils = tuple(
        Neuropil(name or path.stem, file.role, _surface(vertices, faces, file.input.unit))
        for name, (vertices, faces) in sorted(parts.items())
        if len(faces)
    )
    if not neuropils:
        raise InputError(f"{path} holds no face; choose a file with surfaces of neuropils")
    return neuropils


def _surface(vertices: Floats, faces: Integers, unit: Unit) -> SurfaceMesh:
    own, used = compacted(faces)
    return SurfaceMesh(vertices[used] * UM_PER_UNIT[unit], own)


def near_neuropil(
    neuropil: Neuropil, landmarks: Iterable[PlacedLandmark], reach_um: float
) -> tuple[str, ...]:
    """Return the ids of the landmarks within a reach of a neuropil, on the brain it belongs to."""
    marks = tuple(landmarks)
    points = _points(marks, neuropil.role)
    if not len(points):
        return ()
    squared, _, _ = neuropil.surface.tree.nearest(points)
    return _ids(marks, np.sqrt(squared) <= reach_um)


def near_place(
    place: Floats, role: Role, landmarks: Iterable[PlacedLandmark], reach_um: float
) -> tuple[str, ...]:
    """Return the ids of the landmarks within a reach of a (3,) place of a brain."""
    marks = tuple(landmarks)
    away = np.linalg.norm(_points(marks, role) - place, axis=1)
    return _ids(marks, away <= reach_um)


def _points(marks: tuple[PlacedLandmark, ...], role: Role) -> Floats:
    ends = [mark.source_point if role == "source" else mark.target_point for mark in marks]
    return np.array(ends).reshape(-1, 3)


def _ids(marks: tuple[PlacedLandmark, ...], chosen: Booleans) -> tuple[str, ...]:
    return tuple(marks[row].pair.id for row in np.flatnonzero(chosen).tolist())
