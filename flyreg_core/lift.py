"""Stage 7: warped vertices from the target's flat halves back onto its surface, halves sewn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flyreg_core.boundary import CurveKey
from flyreg_core.caps import Cap, cap_grid, carry_cap, find_caps, lay_cap_flat, rim_circle
from flyreg_core.correspondence import FlatBrain, PlacedLandmark
from flyreg_core.boundary_map import map_boundaries
from flyreg_core.halves import FlatHalf, along_outer
from flyreg_core.landmarks import HALVES, HalfName
from flyreg_core.locate import TriangleGrid, find_triangles, strip_grid
from flyreg_core.mesh import FlatMesh, Floats, SurfaceMesh
from flyreg_core.orientation import orientations
from flyreg_core.progress import Report
from flyreg_core.rectangle import from_plane, perimeter_share, to_plane, u_of_perimeter, wrapped
from flyreg_core.thin_plate_spline import ThinPlateSpline
from flyreg_core.unfold import count_flipped, unfold

CLOSEST_TO_BOUNDARY = 1e-6
"""Inner vertices stay this far, as a share of the way across, from both boundaries."""


@dataclass(frozen=True, eq=False)
class Locators:
    """What finding flat triangles of the target needs, built once."""

    halves: Mapping[HalfName, TriangleGrid]
    caps: tuple[Cap, Cap]
    cap_grids: tuple[TriangleGrid, TriangleGrid]


@dataclass(frozen=True, eq=False)
class WarpedHalf:
    """A source half after the spline, in the target's flat domain."""

    flat: FlatMesh  # on the target's strip, without folds
    plane: Floats  # (k, 2) the same in the target's rectangle
    folds_mended: int  # faces that the spline itself had flipped
    flipped: int  # faces flipped in `flat`, decided exactly
    gap_um: float  # how far the boundary had to move to meet the other half and its curves


@dataclass(frozen=True, eq=False)
class Registration:
    """The source's surface on the target."""

    surface: SurfaceMesh  # the source's faces, moved vertices
    halves: Mapping[HalfName, WarpedHalf]
    flipped_on_caps: int
    residual_um: Mapping[str, float]  # by landmark id


def build_locators(target: FlatBrain) -> Locators:
    """Return the locators of both halves and both caps of the target."""
    caps = find_caps(target.dissection, target.curves)
    grids = [cap_grid(cap, lay_cap_flat(cap, rim_circle(cap.side, target.curves))) for cap in caps]
    return Locators(
        {half: strip_grid(target.halves[half].flat) for half in HALVES}, caps, (grids[0], grids[1])
    )


def register(
    source: FlatBrain,
    source_caps: tuple[Cap, Cap],
    target: FlatBrain,
    locators: Locators,
    splines: Mapping[HalfName, ThinPlateSpline],
    kernels: Mapping[HalfName, Floats],
    landmarks: tuple[PlacedLandmark, ...],
    report: Report,
) -> Registration:
    """Return the source's surface carried onto the target by one spline per half.

    Parameters
    ----------
    kernels : half -> (k, l) float
        Kernel between the half's flat vertices and its spline's centers.

    Notes
    -----
    A warped vertex lies in a flat target triangle and takes its barycentric coordinates there to
    the surface (eq. 11-13). Boundary vertices go along their curves, both halves alike; what this
    changes at the boundary fades out linearly towards the other one. Folds that remain are mended
    (`unfold`).
    """
    warped = {
        half: from_plane(splines[half].from_kernel(kernels[half], source.halves[half].plane))
        for half in HALVES
    }
    shifts = {half: wrapped(warped[half][0] - source.halves[half].flat.uv[:, 0]) for half in HALVES}
    mapped = map_boundaries(source, shifts)
    vertices = np.zeros_like(source.dissection.surface.vertices)
    points = target.dissection.surface.vertices
    halves = {}
    for number, half in enumerate(HALVES):
        report(number / 3, "lifting")
        halves[half] = _warp_half(
            source.halves[half],
            target.halves[half],
            shifts[half],
            warped[half][1],
            mapped,
            source,
            report,
        )
        vertices[source.halves[half].vertex_of] = lift(
            halves[half].flat.uv, target.halves[half], locators.halves[half], points
        )
    flipped_on_caps = 0
    for cap, target_cap, grid in zip(source_caps, locators.caps, locators.cap_grids, strict=True):
        carried, flat = carry_cap(
            cap, source.curves, mapped, target_cap, target.curves, grid, points
        )
        vertices[cap.vertex_of] = carried
        flipped_on_caps += int((orientations(flat[cap.faces]) <= 0).sum())
    for key, curve in source.curves.items():
        vertices[curve.vertices] = target.curves[key].at(mapped[key])
    surface = SurfaceMesh(vertices, source.dissection.surface.faces)
    residuals = _residuals(target, locators, splines, landmarks)
    return Registration(surface, halves, flipped_on_caps, residuals)


def lift(uv: Floats, target: FlatHalf, grid: TriangleGrid, points: Floats) -> Floats:
    """Return the (k, 3) surface points of (k, 2) strip coordinates on a half (eq. 13)."""
    inside = np.stack([np.mod(uv[:, 0], 1.0), uv[:, 1]], axis=1)
    face, barycentric = find_triangles(grid, inside)
    corners = points[target.vertex_of[target.faces[face]]]
    return np.einsum("ij,ijk->ik", barycentric, corners)


def _warp_half(
    source: FlatHalf,
    target: FlatHalf,
    shift: Floats,
    beta: Floats,
    mapped: Mapping[CurveKey, Floats],
    brain: FlatBrain,
    report: Report,
) -> WarpedHalf:
    """Return a half after the spline, its boundary on the target's, folds mended."""
    start = source.flat.uv[:, 0]
    u = start + shift
    edge_u = {
        "outer": along_outer(
            source.name,
            {
                key: u_of_perimeter(source.name, perimeter_share(key[0], share))
                for key, share in mapped.items()
            },
        ),
        "hole": u_of_perimeter(source.name, perimeter_share("hole", mapped["hole", None][:-1])),
    }
    far, near = source.beta, 1 - source.beta
    change_u, change_beta = np.zeros_like(u), np.zeros_like(u)
    missed = 0.0
    for edge, loop, goal, fade in (
        ("outer", source.outer, 1.0, far),
        ("hole", source.hole, 0.0, near),
    ):
        miss_u, miss_beta = wrapped(edge_u[edge] - u[loop]), goal - beta[loop]
        missed = max(missed, float(np.abs(miss_u).max()), float(np.abs(miss_beta).max()))
        at = np.mod(start, 1.0)
        order = np.argsort(np.mod(start[loop], 1.0))
        around = np.mod(start[loop], 1.0)[order]
        change_u += fade * np.interp(at, around, miss_u[order], period=1.0)
        change_beta += fade * np.interp(at, around, miss_beta[order], period=1.0)
    u = u + change_u
    beta = np.clip(beta + change_beta, CLOSEST_TO_BOUNDARY, 1 - CLOSEST_TO_BOUNDARY)
    is_fixed = np.zeros(len(u), dtype=bool)
    for edge, loop, goal in (("outer", source.outer, 1.0), ("hole", source.hole, 0.0)):
        u[loop] = (start + shift)[loop] + wrapped(edge_u[edge] - (start + shift)[loop])
        beta[loop] = goal
        is_fixed[loop] = True
    v = target.law.v(beta)
    v[source.outer], v[source.hole] = 1.0, 0.0
    raw = FlatMesh(np.stack([u, v], axis=1), source.faces, source.flat.corner_shifts)
    flat = unfold(raw, source.springs, is_fixed, report)
    plane = to_plane(flat.uv[:, 0], target.law.beta(flat.uv[:, 1]))
    return WarpedHalf(flat, plane, count_flipped(raw), count_flipped(flat), missed)


def _residuals(
    target: FlatBrain,
    locators: Locators,
    splines: Mapping[HalfName, ThinPlateSpline],
    landmarks: tuple[PlacedLandmark, ...],
) -> Mapping[str, float]:
    """Return how far each landmark's source ends from its target on the surface, micrometres."""
    points = target.dissection.surface.vertices
    residuals: dict[str, float] = {}
    for half in HALVES:
        acting = [mark for mark in landmarks if half in mark.plane]
        if not acting:
            continue
        u, beta = from_plane(splines[half](np.array([mark.plane[half][0] for mark in acting])))
        v = target.halves[half].law.v(np.clip(beta, 0, 1))
        ends = lift(np.stack([u, v], axis=1), target.halves[half], locators.halves[half], points)
        for mark, end in zip(acting, ends, strict=True):
            away = float(np.linalg.norm(end - mark.target_point))
            residuals[mark.pair.id] = max(away, residuals.get(mark.pair.id, 0.0))
    return residuals
