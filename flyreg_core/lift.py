"""Stage 7: warped vertices from the target's flat halves back onto its surface, halves sewn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flyreg_core.boundary import CurveKey
from flyreg_core.boundary_map import map_boundaries, seam_gaps
from flyreg_core.caps import Cap, cap_grid, carry_cap, find_caps, lay_cap_flat, rim_circle
from flyreg_core.correspondence import FlatBrain, PlacedLandmark
from flyreg_core.halves import FlatHalf, along_outer
from flyreg_core.landmarks import HALVES, HalfName
from flyreg_core.locate import TriangleGrid, find_triangles, strip_grid
from flyreg_core.mesh import Booleans, FlatMesh, Floats, SurfaceMesh
from flyreg_core.orientation import orientations
from flyreg_core.progress import Report
from flyreg_core.rectangle import from_plane, perimeter_share, to_plane, u_of_perimeter, wrapped
from flyreg_core.thin_plate_spline import ThinPlateSpline
from flyreg_core.unfold import count_flipped, unfold

CLOSEST_TO_BOUNDARY = 1e-14
"""Inner vertices stay this far, as a share of the way across, from both boundaries.

Pockets of real brains crowd down to 1e-12 from a boundary and must not be moved.
"""


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
    is_mended: Booleans  # (k,) vertices that moved for it
    flipped: int  # faces flipped in `flat`, decided exactly
    gap_um: float  # how far sewing moved its boundary along the target's curves


@dataclass(frozen=True, eq=False)
class Registration:
    """The source's surface on the target."""

    surface: SurfaceMesh  # the source's faces, moved vertices
    halves: Mapping[HalfName, WarpedHalf]
    flipped_on_caps: int
    residual_um: Mapping[str, float]  # by id of the landmarks that act, in the delivered surface


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
    gaps = seam_gaps(source, target, shifts, mapped)
    vertices = np.zeros_like(source.dissection.surface.vertices)
    points = target.dissection.surface.vertices
    halves = {}
    for number, half in enumerate(HALVES):
        report(number / 3, "lifting")
        flat = _warp_half(source.halves[half], target.halves[half], warped[half], mapped)
        halves[half] = _mend(source.halves[half], target.halves[half], flat, gaps[half], report)
        vertices[source.halves[half].vertex_of] = lift(
            halves[half].flat.uv, target.halves[half], locators.halves[half], points
        )
    flipped_on_caps = 0
    for cap, target_cap, grid in zip(source_caps, locators.caps, locators.cap_grids, strict=True):
        carried, flat_cap = carry_cap(
            cap, source.curves, mapped, target_cap, target.curves, grid, points
        )
        vertices[cap.vertex_of] = carried
        flipped_on_caps += int((orientations(flat_cap[cap.faces]) <= 0).sum())
    for key, curve in source.curves.items():
        vertices[curve.vertices] = target.curves[key].at(mapped[key])
    surface = SurfaceMesh(vertices, source.dissection.surface.faces)
    residuals = _residuals(surface, landmarks)
    return Registration(surface, halves, flipped_on_caps, residuals)


def lift(uv: Floats, target: FlatHalf, grid: TriangleGrid, points: Floats) -> Floats:
    """Return the (k, 3) surface points of (k, 2) strip coordinates on a half (eq. 13)."""
    inside = np.stack([np.mod(uv[:, 0], 1.0), uv[:, 1]], axis=1)
    face, barycentric = find_triangles(grid, inside)
    if (face < 0).any():
        raise ValueError(
            f"{(face < 0).sum()} flat places lie in no triangle of the {target.name} half"
        )
    corners = points[target.vertex_of[target.faces[face]]]
    return np.asarray(np.einsum("ij,ijk->ik", barycentric, corners))


def _warp_half(
    source: FlatHalf,
    target: FlatHalf,
    warped: tuple[Floats, Floats],
    mapped: Mapping[CurveKey, Floats],
) -> FlatMesh:
    """Return a half after the spline on the target's strip, its boundary on the target's curves."""
    start, beta = source.flat.uv[:, 0], warped[1].copy()
    u = start + wrapped(warped[0] - start)
    goals = {
        key: u_of_perimeter(source.name, perimeter_share(key[0], share))
        for key, share in mapped.items()
    }
    boundaries = (
        (source.outer, along_outer(source.name, goals), 1.0, source.beta),
        (source.hole, goals["hole", None][:-1], 0.0, 1 - source.beta),
    )
    change_u, change_beta = np.zeros_like(u), np.zeros_like(u)
    for loop, goal_u, goal_beta, fading in boundaries:
        around = np.mod(start[loop], 1.0)
        for change, miss in (
            (change_u, wrapped(goal_u - u[loop])),
            (change_beta, goal_beta - beta[loop]),
        ):
            change += fading * np.interp(start, around, miss, period=1.0)
    for loop, goal_u, goal_beta, _ in boundaries:
        change_u[loop] = wrapped(goal_u - u[loop])
        beta[loop], change_beta[loop] = goal_beta, 0.0
    beta = np.clip(beta + change_beta, CLOSEST_TO_BOUNDARY, 1 - CLOSEST_TO_BOUNDARY)
    v = target.law.v(beta)
    v[source.outer], v[source.hole] = 1.0, 0.0
    return FlatMesh(np.stack([u + change_u, v], axis=1), source.faces, source.flat.corner_shifts)


def _mend(
    source: FlatHalf, target: FlatHalf, raw: FlatMesh, gap_um: float, report: Report
) -> WarpedHalf:
    is_fixed = np.zeros(len(raw.uv), dtype=bool)
    is_fixed[source.outer] = is_fixed[source.hole] = True
    flat = unfold(raw, source.springs, is_fixed, report)
    plane = to_plane(flat.uv[:, 0], target.law.beta(flat.uv[:, 1]))
    is_mended = (flat.uv != raw.uv).any(axis=1)
    return WarpedHalf(flat, plane, count_flipped(raw), is_mended, count_flipped(flat), gap_um)


def _residuals(
    registered: SurfaceMesh, landmarks: tuple[PlacedLandmark, ...]
) -> Mapping[str, float]:
    """Return how far from its target each acting landmark's source place ended, micrometres."""
    residuals = {}
    for mark in landmarks:
        if mark.plane:
            end = mark.source_corners @ registered.vertices[registered.faces[mark.source_face]]
            residuals[mark.pair.id] = float(np.linalg.norm(end - mark.target_point))
    return residuals
