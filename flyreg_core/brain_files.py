"""Read brains of every kind as surfaces in micrometres; write meshes in any unit.

A brain is a surface, the points of one, or labelled voxels, from a file or a template. Its unit is
stated by the user, known from the template's metadata or the file's header, or judged from the
size; which of these is kept with it, to be said aloud.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flyreg_core import mesh_formats, point_formats, templates, volume_formats
from flyreg_core.brain_checks import UM_PER_UNIT, check_single, check_size, find_unit
from flyreg_core.errors import InputError, MeshError
from flyreg_core.files import check_place, read_bytes, write_atomically
from flyreg_core.label_volume import label_surface
from flyreg_core.mesh import Floats, Integers, SurfaceMesh
from flyreg_core.point_cloud import FEWEST_POINTS, PointCloud, reconstruct_surface
from flyreg_core.progress import Report, ignore, within
from flyreg_core.project import BrainInput, InputKind, Unit
from flyreg_core.templates import template_file, template_labels
from flyreg_core.topology import compacted
from flyreg_core.volume_formats import VolumeHeader

__all__ = [
    "UM_PER_UNIT",
    "accept_changed_file",
    "check_mesh_place",
    "input_facts",
    "open_brain",
    "read_brain",
    "template_file",
    "template_labels",
    "write_mesh",
]

NOT_READ = (".vtp", ".vtu")
"""VTK XML files, which only VTK can read."""
READ = (*mesh_formats.ENDINGS, *point_formats.ENDINGS, *volume_formats.ENDINGS)
"""Endings of the files that can be read."""

Geometry = tuple[Floats, Integers] | PointCloud


def open_brain(
    name: str,
    unit: Unit | None = None,
    voxel_size_um: tuple[float, float, float] | None = None,
) -> BrainInput:
    """Return a file or template as an input, with its unit and a checksum of its content.

    What takes long, such as finding a surface among points or voxels, is left to `read_brain`.

    Parameters
    ----------
    name : str
        A path, or the label of a template of the flybrains package; a file goes first.
    unit : {"nm", "um", "mm"}, optional
        The unit of the file as the user states it; None finds it out.
    voxel_size_um : (3,) float, optional
        Edges of a voxel along the axes of a volume, the fastest in the file first (x, y, z), as
        the user states them; None takes them from the file.

    Raises
    ------
    InputError
        There is no such file or template, it holds no one brain, or its unit or voxel size cannot
        be told or does not fit its size.
    """
    path = _find(name)
    if volume_formats.is_volume(path):
        return _open_volume(name, path, unit, voxel_size_um)
    if voxel_size_um is not None:
        raise InputError(f"{path} has no voxels; leave the voxel size out")
    return _open_geometry(name, path, unit)


def _open_geometry(name: str, path: Path, unit: Unit | None) -> BrainInput:
    content = read_bytes(path)
    geometry = _decode(content, path)
    if isinstance(geometry, PointCloud):
        kind: InputKind = "point cloud"
        vertices = geometry.points
    else:
        kind = "surface"
        vertices = geometry[0]
    extent = float(np.ptp(vertices, axis=0).max())
    known, known_by = find_unit(name, path, extent, unit)
    check_size(path, extent, known)
    if not isinstance(geometry, PointCloud):
        check_single(vertices * UM_PER_UNIT[known], geometry[1], path)
    sha256 = hashlib.sha256(content).hexdigest()
    return BrainInput(name, str(path), sha256, known, known_by, kind)


def _open_volume(
    name: str, path: Path, unit: Unit | None, voxel_size_um: tuple[float, float, float] | None
) -> BrainInput:
    sha256 = _checksum(path)
    header = volume_formats.read_header(path)
    if voxel_size_um is not None:
        stated = BrainInput(
            name, str(path), sha256, "um", "stated by the user", "label volume", voxel_size_um
        )
        check_size(path, _header_um(stated).extent, "um")
        return stated
    if not header.has_voxel_size:
        raise InputError(
            f"{path} does not say how large its voxels are; state their edges along x, y and z in "
            "um with --voxel-size, --source-voxel-size or --target-voxel-size"
        )
    if unit is None and header.unit is not None:
        known, known_by = header.unit, "file header"
    else:
        known, known_by = find_unit(name, path, header.extent, unit)
    check_size(path, header.extent, known)
    return BrainInput(name, str(path), sha256, known, known_by, "label volume")


def read_brain(brain: BrainInput, report: Report = ignore) -> SurfaceMesh:
    """Return the surface of a brain in micrometres, faces counter-clockwise seen from outside.

    Vertices that no face uses are left out, and a surface that is inside out is turned. Points and
    labels become the closed surface that they lie on or fill.

    Raises
    ------
    InputError
        The file has changed since the brain was opened, its points or labels have no surface, or
        see `open_brain`.
    Cancelled
        `report` said so.
    """
    path = Path(brain.path)
    report(0.0, "reading the brain")
    if brain.kind == "label volume":
        _check_unchanged(brain, _checksum(path))
        vertices, faces = _read_volume(brain, report)
    else:
        content = read_bytes(path)
        _check_unchanged(brain, hashlib.sha256(content).hexdigest())
        geometry = _decode(content, path)
        vertices, faces = _in_um(geometry, brain, report)
    check_size(path, float(np.ptp(vertices, axis=0).max()) / UM_PER_UNIT[brain.unit], brain.unit)
    check_single(vertices, faces, path)
    mesh = SurfaceMesh(vertices - vertices.mean(axis=0), faces)  # volume of an open one: about it
    return SurfaceMesh(vertices, faces[:, ::-1] if mesh.volume < 0 else faces)


def _in_um(geometry: Geometry, brain: BrainInput, report: Report) -> tuple[Floats, Integers]:
    factor = UM_PER_UNIT[brain.unit]
    if not isinstance(geometry, PointCloud):
        return geometry[0] * factor, geometry[1]
    cloud = PointCloud(geometry.points * factor, geometry.normals)
    check_size(Path(brain.path), float(np.ptp(geometry.points, axis=0).max()), brain.unit)
    try:
        surface = reconstruct_surface(cloud, within(report, 0.2, 1.0))
    except MeshError as error:
        raise InputError(f"{brain.path} cannot be used: {error}") from error
    return surface.vertices, surface.faces


def _read_volume(brain: BrainInput, report: Report) -> tuple[Floats, Integers]:
    path = Path(brain.path)
    header = _header_um(brain)
    check_size(path, header.extent / UM_PER_UNIT[brain.unit], brain.unit)
    labels = volume_formats.read_labels(path)
    try:
        surface = label_surface(labels, header, within(report, 0.4, 1.0))
    except MeshError as error:
        raise InputError(f"{path} cannot be used: {error}") from error
    return surface.vertices, surface.faces


def _header_um(brain: BrainInput) -> VolumeHeader:
    header = volume_formats.read_header(Path(brain.path))
    if brain.voxel_size_um is not None:
        return header.with_voxel_size(brain.voxel_size_um)
    return header.scaled(UM_PER_UNIT[brain.unit])


def input_facts(brain: BrainInput) -> Mapping[str, object]:
    """Return what is worth knowing of a brain's file besides its surface, by name.

    Returns
    -------
    mapping
        For a point cloud `points` and `has_normals`; for a label volume `voxels`, along each axis,
        and `voxel_size_um`; for a surface nothing.

    Raises
    ------
    InputError
        See `open_brain`.
    """
    path = Path(brain.path)
    if brain.kind == "label volume":
        header = _header_um(brain)
        return {"voxels": list(header.shape), "voxel_size_um": header.voxel_size.tolist()}
    geometry = _decode(read_bytes(path), path) if brain.kind == "point cloud" else None
    if not isinstance(geometry, PointCloud):
        return {}
    return {"points": len(geometry.points), "has_normals": geometry.normals is not None}


def voxel_edge_um(brain: BrainInput) -> float | None:
    """Return the edge of a cube as large as a voxel of a label volume; None for other inputs.

    None too if the file is gone: what was read from it may outlast it.
    """
    if brain.kind != "label volume":
        return None
    try:
        return float(np.cbrt(_header_um(brain).voxel_size.prod()))
    except InputError:
        return None


def _checksum(path: Path) -> str:
    """Return the checksum of all files of a volume, without keeping them in memory."""
    digest = hashlib.sha256()
    for file in volume_formats.files_of(path):
        try:
            with file.open("rb") as content:
                while part := content.read(1 << 20):
                    digest.update(part)
        except OSError:
            read_bytes(file)  # tells what is wrong
            raise
    return digest.hexdigest()


def check_unchanged(brain: BrainInput) -> None:
    """Raise `InputError` if the file of a brain is gone, or has changed since it was opened."""
    path = Path(brain.path)
    is_volume = brain.kind == "label volume"
    digest = _checksum(path) if is_volume else hashlib.sha256(read_bytes(path)).hexdigest()
    _check_unchanged(brain, digest)


def _check_unchanged(brain: BrainInput, sha256: str) -> None:
    if sha256 != brain.sha256:
        raise InputError(
            f"{brain.path} has changed since the project was saved; accept the new file, or put "
            "the old one back"
        )


def accept_changed_file(brain: BrainInput) -> BrainInput:
    """Return a brain with its file as it is now; a unit or voxel size that was stated stays.

    Raises
    ------
    InputError
        See `open_brain`.
    """
    stated = brain.unit if brain.unit_known_by == "stated by the user" else None
    if brain.voxel_size_um is not None:
        stated = None
    return replace(open_brain(brain.path, stated, brain.voxel_size_um), name=brain.name)


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


def _decode(content: bytes, path: Path) -> Geometry:
    """Return a file's points, or the used vertices and the faces of its mesh, in its own unit."""
    if path.suffix.lower() in NOT_READ:
        raise InputError(
            f"{path} is a VTK XML file, which flyreg cannot read; convert its surface to PLY"
        )
    if point_formats.is_point_text(path):
        cloud = point_formats.decode(content, path)
        return _checked_cloud(cloud.points, cloud.normals, path)
    if path.suffix.lower() not in mesh_formats.ENDINGS:
        raise InputError(
            f"{path} has the unknown ending {path.suffix or '(none)'}; flyreg reads "
            f"{', '.join(sorted(READ))}"
        )
    vertices, faces = mesh_formats.decode(content, path)
    if not len(faces):
        is_ply = path.suffix.lower() == ".ply"
        normals = point_formats.ply_normals(content) if is_ply and len(vertices) else None
        return _checked_cloud(vertices, normals, path)
    _check_finite(vertices, "vertices", path)
    faces, used = compacted(faces)
    return vertices[used], faces


def _checked_cloud(points: Floats, normals: Floats | None, path: Path) -> PointCloud:
    _check_finite(points, "points", path)
    if normals is not None:
        _check_finite(normals, "normals", path)
    if len(points) < FEWEST_POINTS:
        raise InputError(
            f"{path} has no faces, only {len(points):,} points, too few for a surface; give at "
            f"least {FEWEST_POINTS:,} points, or a triangle mesh"
        )
    return PointCloud(points, normals)


def _check_finite(values: Floats, things: str, path: Path) -> None:
    wrong = int((~np.isfinite(values)).any(axis=1).sum())
    if wrong:
        raise InputError(
            f"{path} is damaged: {wrong:,} of {len(values):,} {things} have coordinates that "
            "are infinite or no numbers; export it again"
        )
