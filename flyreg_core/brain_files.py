"""Read brains from mesh files and templates, in micrometres; write meshes in any unit.

A brain's unit is stated by the user, known from the template's metadata, or judged from the size;
which of these is kept with it, to be said aloud.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flyreg_core import mesh_formats, templates
from flyreg_core.errors import InputError
from flyreg_core.files import check_place, read_bytes, write_atomically
from flyreg_core.mesh import Floats, Integers, SurfaceMesh
from flyreg_core.project import BrainInput, Unit
from flyreg_core.templates import template_file, template_labels
from flyreg_core.topology import compacted, component_of_vertex

__all__ = [
    "UM_PER_UNIT",
    "accept_changed_file",
    "check_mesh_place",
    "open_brain",
    "read_brain",
    "template_file",
    "template_labels",
    "write_mesh",
]

UM_PER_UNIT: Mapping[Unit, float] = {"nm": 1e-3, "um": 1.0, "mm": 1e3}
"""Micrometres in one of each unit."""
USUAL_UM = (150.0, 2000.0)
"""Largest extents by which a unit is judged, micrometres; a fly brain has 300 to 900."""
POSSIBLE_UM = (100.0, 3000.0)
"""Largest extents that are believed when the unit is stated, micrometres."""
TWIN_SHARE = 0.6
"""A surface beside the largest one is a brain too if its box has at least this share of the volume.

Optic lobes that hang on nothing, as in the templates Dsim and JRC2018F, have up to 0.43.
"""
NOT_READ_YET = {
    "a label volume": (".nrrd", ".nhdr", ".tif", ".tiff", ".nii", ".nii.gz"),
    "an Amira surface": (".surf",),
    "a VTK XML file": (".vtp", ".vtu"),
}


def open_brain(name: str, unit: Unit | None = None) -> BrainInput:
    """Return a file or template as an input, with its unit and a checksum of its content.

    Parameters
    ----------
    name : str
        A path, or the label of a template of the flybrains package; a file goes first.
    unit : {"nm", "um", "mm"}, optional
        The unit of the file as the user states it; None finds it out.

    Raises
    ------
    InputError
        There is no such file or template, it holds no surface of one brain, or its unit cannot be
        told or does not fit its size.
    """
    path = _find(name)
    content = read_bytes(path)
    vertices, faces = _decode(content, path)
    extent = float(np.ptp(vertices, axis=0).max())
    known, known_by = _find_unit(name, path, extent, unit)
    _check_size(path, extent, known)
    _check_single(vertices * UM_PER_UNIT[known], faces, path)
    sha256 = hashlib.sha256(content).hexdigest()
    return BrainInput(name, str(path), sha256, known, known_by)


def read_brain(brain: BrainInput) -> SurfaceMesh:
    """Return the surface of a brain in micrometres, faces counter-clockwise seen from outside.

    Vertices that no face uses are left out, and a surface that is inside out is turned.

    Raises
    ------
    InputError
        The file has changed since the brain was opened, or see `open_brain`.
    """
    path = Path(brain.path)
    content = read_bytes(path)
    if hashlib.sha256(content).hexdigest() != brain.sha256:
        raise InputError(
            f"{path} has changed since the project was saved; accept the new file, or put the "
            "old one back"
        )
    vertices, faces = _decode(content, path)
    _check_size(path, float(np.ptp(vertices, axis=0).max()), brain.unit)
    vertices = vertices * UM_PER_UNIT[brain.unit]
    _check_single(vertices, faces, path)
    mesh = SurfaceMesh(vertices - vertices.mean(axis=0), faces)  # volume of an open one: about it
    return SurfaceMesh(vertices, faces[:, ::-1] if mesh.volume < 0 else faces)


def accept_changed_file(brain: BrainInput) -> BrainInput:
    """Return a brain with its file as it is now; a unit that was stated stays.

    Raises
    ------
    InputError
        See `open_brain`.
    """
    stated = brain.unit if brain.unit_known_by == "stated by the user" else None
    return replace(open_brain(brain.path, stated), name=brain.name)


def check_mesh_place(path: Path) -> None:
    """Tell before long work whether a mesh could be written there.

    Raises
    ------
    InputError
        No mesh is written with this suffix, or see `files.check_place`.
    """
    mesh_formats.check_writable(path.suffix)
    check_place(path)


def write_mesh(
    path: Path,
    mesh: SurfaceMesh,
    unit: Unit,
    properties: Mapping[str, NDArray[Any]] | None = None,
) -> None:
    """Write a mesh in a unit, in the format of the suffix; equal meshes give equal bytes.

    Parameters
    ----------
    path : Path
        Ends in .ply, .obj, .stl, .off, .glb or .vtk.
    properties : mapping of str to (n,) number, optional
        One number for each vertex, by name; kept in PLY and VTK files only, and not rescaled.

    Raises
    ------
    InputError
        Another suffix, or the file cannot be written (see `files.write_atomically`).
    """
    vertices = mesh.vertices / UM_PER_UNIT[unit]
    write_atomically(path, mesh_formats.encode(path.suffix, vertices, mesh.faces, properties or {}))


def _find(name: str) -> Path:
    path = Path(name).expanduser().absolute()
    if path.is_file():
        return path
    if template := template_file(name):
        return template
    if path.exists() or path.suffix or path.name != name:
        return path  # reading it tells what is wrong
    if not templates.is_installed():
        raise InputError(
            f"there is no file {name}; if it is a template of the flybrains package, install that "
            'by: pip install "flyreg[templates]"'
        )
    near = templates.similar_labels(name)
    offer = (
        f"similar templates are {', '.join(near)}"
        if near
        else "templates are " + ", ".join(template_labels())
    )
    raise InputError(f"there is no file and no template {name}; {offer}")


def _decode(content: bytes, path: Path) -> tuple[Floats, Integers]:
    """Return the used vertices, in the file's unit, and the faces of a mesh file."""
    for kind, endings in NOT_READ_YET.items():
        if path.name.lower().endswith(endings):
            raise InputError(
                f"{path} is {kind}, which flyreg cannot read yet; convert its surface to PLY"
            )
    vertices, faces = mesh_formats.decode(content, path)
    if not len(faces):
        raise InputError(
            f"{path} has no faces, only {len(vertices):,} points; flyreg can read surfaces only "
            "so far, so make a triangle mesh of them"
        )
    wrong = int((~np.isfinite(vertices)).any(axis=1).sum())
    if wrong:
        raise InputError(
            f"{path} is damaged: {wrong:,} of {len(vertices):,} vertices have coordinates that "
            "are infinite or no numbers; export it again"
        )
    faces, used = compacted(faces)
    return vertices[used], faces


def _find_unit(name: str, path: Path, extent: float, stated: Unit | None) -> tuple[Unit, str]:
    if stated is not None:
        return stated, "stated by the user"
    by_metadata = templates.template_unit(name) if path == template_file(name) else None
    if by_metadata == "voxels":
        raise InputError(
            f"the template {name} is measured in voxels, whose size flyreg does not know; scale "
            "it to micrometres and save that as a file"
        )
    for unit, um in UM_PER_UNIT.items():
        if unit == by_metadata:
            return unit, "template metadata"
        if by_metadata is None and USUAL_UM[0] <= extent * um <= USUAL_UM[1]:
            return unit, "judged from the size"
    raise InputError(
        f"the unit of {path} cannot be judged: it is {extent:,.6g} units across, and a fly brain "
        "is 300 to 900 um; state the unit with --source-unit or --target-unit"
    )


def _check_size(path: Path, extent: float, unit: Unit) -> None:
    extent_um = extent * UM_PER_UNIT[unit]
    if not POSSIBLE_UM[0] <= extent_um <= POSSIBLE_UM[1]:
        raise InputError(
            f"{path} is {extent:,.6g} units across, so in {unit} it is {extent_um:,.6g} um, and a "
            "fly brain is 300 to 900 um: the unit is off by 1,000 or so; state the right one with "
            "--source-unit or --target-unit"
        )


def _check_single(vertices: Floats, faces: Integers, path: Path) -> None:
    component = component_of_vertex(faces, len(vertices))
    count = int(component.max()) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, component, vertices)
    np.maximum.at(high, component, vertices)
    volume = (high - low).prod(axis=1)
    largest = int(volume.argmax())
    is_apart = ((low > high[largest]) | (high < low[largest])).any(axis=1)
    twins = np.flatnonzero(is_apart & (volume >= TWIN_SHARE * volume[largest]))
    if len(twins):
        one, other = (
            "(" + ", ".join(f"{x:.0f}" for x in (low[i] + high[i]) / 2) + ")"
            for i in (largest, twins[0])
        )
        raise InputError(
            f"{path} holds two brains or halves of one, centred at {one} and {other} um; save the "
            "one you mean, in one piece, in a file of its own"
        )
