"""The values that travel between stages: surfaces in space and surfaces laid flat."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from flyreg_core.errors import MeshError
from flyreg_core.normals import face_normals, vertex_normals
from flyreg_core.surface_tree import SurfaceTree, build_tree

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class SurfaceMesh:
    """Triangle mesh. Never modified after construction, so it is compared by identity."""

    vertices: Floats  # (n, 3), micrometres
    faces: Integers  # (m, 3), counter-clockwise seen from outside

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", read_only(self.vertices, np.float64, 3, "vertices"))
        object.__setattr__(self, "faces", read_only(self.faces, np.int64, 3, "faces"))
        _check_indices(self.faces, len(self.vertices))

    def moved(self, vertices: Floats) -> SurfaceMesh:
        """Return the same faces over as many vertices in other places."""
        return _with_places(self, "vertices", read_only(vertices, np.float64, 3, "vertices"))

    @cached_property
    def tree(self) -> SurfaceTree:
        """Boxes within boxes that find the places nearest to points."""
        return build_tree(self.vertices, self.faces)

    @cached_property
    def face_normals(self) -> Floats:
        """(m, 3) normals of length twice the face area."""
        return face_normals(self.vertices, self.faces)

    @cached_property
    def face_areas(self) -> Floats:
        """(m,) areas, square micrometres."""
        return np.asarray(np.linalg.norm(self.face_normals, axis=1) / 2)

    @cached_property
    def vertex_areas(self) -> Floats:
        """(n,) areas around vertices, a third of that of their faces, square micrometres."""
        areas = np.repeat(self.face_areas / 3, 3)
        return np.asarray(np.bincount(self.faces.reshape(-1), areas, len(self.vertices)), float)

    @cached_property
    def vertex_normals(self) -> Floats:
        """(n, 3) unit normals, area-weighted means of the faces around; 0 where there is no face."""
        return vertex_normals(self.vertices, self.faces)

    @property
    def diagonal(self) -> float:
        """Length of the bounding box's diagonal, micrometres."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    @property
    def volume(self) -> float:
        """Enclosed volume of a closed mesh, cubic micrometres; negative if turned inside out."""
        return float(np.einsum("ij,ij->", self.vertices[self.faces[:, 0]], self.face_normals)) / 6


@dataclass(frozen=True, eq=False)
class FlatMesh:
    """A half laid flat on a strip that closes on itself.

    `uv[:, 0]` runs once around (period 1, values may lie outside [0, 1)); `uv[:, 1]` runs from
    0 on the hole to 1 on the outer boundary.
    """

    uv: Floats  # (n, 2)
    faces: Integers  # (m, 3)
    corner_shifts: Integers  # (m, 3), whole turns added to u of each corner of each face

    def __post_init__(self) -> None:
        object.__setattr__(self, "uv", read_only(self.uv, np.float64, 2, "uv"))
        object.__setattr__(self, "faces", read_only(self.faces, np.int64, 3, "faces"))
        shifts = read_only(self.corner_shifts, np.int64, 3, "corner_shifts")
        object.__setattr__(self, "corner_shifts", shifts)
        _check_indices(self.faces, len(self.uv))

    def moved(self, uv: Floats) -> FlatMesh:
        """Return the same faces over as many vertices in other places."""
        moved = _with_places(self, "uv", read_only(uv, np.float64, 2, "uv"))
        object.__setattr__(moved, "corner_shifts", self.corner_shifts)
        return moved

    @cached_property
    def corners(self) -> Floats:
        """(m, 3, 2) uv of each face's corners, shifted so that each face is one triangle."""
        corners = self.uv[self.faces]
        corners[..., 0] += self.corner_shifts
        return corners


Mesh = TypeVar("Mesh", SurfaceMesh, FlatMesh)


def read_only(values: ArrayLike, dtype: DTypeLike, columns: int, name: str) -> NDArray[np.generic]:
    """Return an (n, columns) read-only array; one that is already read-only is shared, not copied."""
    array = np.asarray(values, dtype=dtype, order="C")
    if array.ndim != 2 or array.shape[1] != columns:
        raise MeshError(f"{name} must have shape (n, {columns}), not {array.shape}")
    if array.flags.writeable:
        array = array.copy()
        array.setflags(write=False)
    return array


def _with_places(mesh: Mesh, name: str, places: NDArray[np.generic]) -> Mesh:
    """Return a mesh with the faces of another one, which need no second check."""
    if len(places) != len(getattr(mesh, name)):
        raise MeshError(f"{len(getattr(mesh, name))} vertices cannot lie at {len(places)} places")
    moved = object.__new__(type(mesh))
    object.__setattr__(moved, name, places)
    object.__setattr__(moved, "faces", mesh.faces)
    return moved


def _check_indices(faces: Integers, n_vertices: int) -> None:
    first, last = faces.min(initial=0), faces.max(initial=-1)
    if first < 0 or last >= n_vertices:
        raise MeshError(f"faces use vertices {first} to {last} of {n_vertices}")
