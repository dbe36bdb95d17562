"""Stage 3a (optional): fewer vertices, with the distortion that costs."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import manifold3d
import numpy as np

from flyreg_core.errors import MeshError
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.progress import Report

FEWEST_VERTICES = 10_000
"""Below this the paper found the shape distorted (3.1 A, Fig. 7)."""
SMALLEST_SHARE = 0.2
"""Keep at least this share of the vertices (4.2 of the paper)."""
TRIALS = 12


@dataclass(frozen=True)
class SimplifyParameters:
    """How many vertices a brain shall have.

    None keeps all, and adds some where another brain is more detailed (`match_detail`). A number is
    kept to: vertices are left out, or added where another brain asks for them.
    """

    vertices: int | None = None


@dataclass(frozen=True, eq=False)
class Simplified:
    """A surface with fewer vertices, and how far it left the one it came from."""

    surface: SurfaceMesh
    mean_distance_um: float  # of the original vertices to the simplified surface
    largest_distance_um: float
    area_share: float  # simplified area over original area
    warnings: tuple[str, ...] = ()


def simplify(surface: SurfaceMesh, parameters: SimplifyParameters, report: Report) -> Simplified:
    """Return the surface with at most about the wanted number of vertices and the same topology.

    Edges are collapsed while no vertex moves by more than a tolerance; the tolerance is bisected
    until the number of vertices is just below what was asked for.

    Raises
    ------
    MeshError
        Fewer than 100 vertices are asked for, or the surface cannot be made that coarse.

    References
    ----------
    3.1 A and 4.2 of the paper. Manifold's decimation keeps the surface closed and its genus.
    """
    wanted = parameters.vertices
    if wanted is None or wanted >= len(surface.vertices):
        return Simplified(surface, 0.0, 0.0, 1.0)
    if wanted < 100:
        raise MeshError(
            f"{wanted} vertices cannot describe a brain; keep at least {FEWEST_VERTICES}"
        )
    solid = _solid(surface)
    low, high = 0.0, surface.diagonal / 20
    for trial in range(TRIALS):
        report(trial / TRIALS, "simplifying the surface")
        middle = (low + high) / 2 if trial else high
        if solid.simplify(middle).num_vert() <= wanted:
            high = middle
        else:
            low = middle
    coarse = _surface(solid.simplify(high))
    if len(coarse.vertices) > wanted:
        raise MeshError(
            f"the surface cannot be simplified to {wanted} vertices without losing its shape; "
            f"{len(coarse.vertices)} is the fewest"
        )
    squared, _, _ = igl.point_mesh_squared_distance(surface.vertices, coarse.vertices, coarse.faces)
    return Simplified(
        coarse,
        float(np.sqrt(squared).mean()),
        float(np.sqrt(squared.max())),
        float(coarse.face_areas.sum() / surface.face_areas.sum()),
        _warnings(len(surface.vertices), wanted),
    )


def coarser(surface: SurfaceMesh, tolerance_um: float) -> SurfaceMesh:
    """Return a closed surface with edges collapsed while no vertex moves by more than a tolerance."""
    return _surface(_solid(surface).simplify(tolerance_um))


def _solid(surface: SurfaceMesh) -> manifold3d.Manifold:
    return manifold3d.Manifold(
        manifold3d.Mesh64(np.array(surface.vertices), surface.faces.astype(np.uint64))
    )


def _surface(solid: manifold3d.Manifold) -> SurfaceMesh:
    mesh = solid.to_mesh64()
    return SurfaceMesh(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts))


def _warnings(before: int, wanted: int) -> tuple[str, ...]:
    if wanted < FEWEST_VERTICES:
        return (f"{wanted} vertices are fewer than {FEWEST_VERTICES}: expect a distorted shape",)
    if wanted < SMALLEST_SHARE * before:
        return (f"{wanted} of {before} vertices are less than a fifth: expect a distorted shape",)
    return ()
