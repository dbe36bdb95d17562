"""Stage 7: warped vertices from the target's flat halves back onto its surface, halves sewn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit

from flyreg_core.boundary import CurveKey
from flyreg_core.boundary_map import map_boundaries, seam_gaps
from flyreg_core.caps import (
    Cap,
    CarriedCap,
    cap_grid,
    carry_cap,
    find_caps,
    lay_cap_flat,
    rim_circle,
)
from flyreg_core.correspondence import FlatBrain, PlacedLandmark
from flyreg_core.halves import FlatHalf, along_outer
from flyreg_core.landmarks import HALVES, HalfName
from flyreg_core.locate import TriangleGrid, find_triangles, once_around, strip_grid
from flyreg_core.mesh import Booleans, FlatMesh, Floats, Integers, SurfaceMesh
from flyreg_core.progress import Report
from flyreg_core.rectangle import (
    RadialLaw,
    from_plane,
    perimeter_share,
    to_plane,
    u_of_perimeter,
    wrapped,
)
from flyreg_core.side_by_side import both_halves
from flyreg_core.strip_warp import draw_along, to_strip
from flyreg_core.unfold import Unfolded, unfold

CLOSEST_TO_BOUNDARY = 1e-14
"""Inner vertices stay this far, as a share of the way across, from both boundaries.

Pockets of real brains crowd down to 1e-12 from a boundary and must not be moved.
"""


@dataclass(frozen=True, eq=False)
class Locators:
    """What finding flat triangles of the target needs, built once."""

    halves: Mapping[HalfName, TriangleGrid]
    corners: Mapping[HalfName, Floats]  # (m, 3, 3), of their faces on the surface, micrometres
    cap_grids: tuple[TriangleGrid, TriangleGrid]
    cap_corners: tuple[Floats, Floats]


@dataclass(frozen=True, eq=False)
class WarpedHalf:
    """A source half after the spline, in the target's flat domain."""

    flat: FlatMesh  # on the target's strip, without folds
    law: RadialLaw  # of the target's half
    face: Integers  # (k,), of the target's half, where each vertex lies
    folds_mended: int  # faces that the spline itself had flipped
    is_mended: Booleans  # (k,) vertices that moved for it
    flipped: int  # faces flipped in `flat`, decided exactly
    gaps_um: Mapping[CurveKey, Floats]  # how far sewing moved the vertices of each of its curves

    @cached_property
    def gap_um(self) -> float:
        """How far sewing moved its boundary along the target's curves, at most."""
        return max(float(gaps.max()) for gaps in self.gaps_um.values())

    @cached_property
    def plane(self) -> Floats:
        """(k, 2) places in the target's rectangle."""
        return to_plane(self.flat.uv[:, 0], self.law.beta(self.flat.uv[:, 1]))


@dataclass(frozen=True, eq=False)
class Registration:
    """The source's surface on the target."""

    surface: SurfaceMesh  # the source's faces, moved vertices
    halves: Mapping[HalfName, WarpedHalf]
    caps: tuple[CarriedCap, CarriedCap]
    residual_um: Mapping[str, float]  # by id of the landmarks that act, in the delivered surface

    @property
    def flipped_on_caps(self) -> int:
        """Faces flipped on the caps laid flat, decided exactly."""
        return sum(cap.flipped for cap in self.caps)


@dataclass(frozen=True, eq=False)
class LandmarkEnds:
    """Where the landmarks that act lie on the source's surface, and where they should come to lie."""

    ids: tuple[str, ...]
    faces: Integers  # (n,), of the source
    barycentric: Floats  # (n, 3)
    targets: Floats  # (n, 3), micrometres


def find_ends(landmarks: tuple[PlacedLandmark, ...]) -> LandmarkEnds:
    """Return the ends of the landmarks that act."""
    acting = [mark for mark in landmarks if mark.plane]
    return LandmarkEnds(
        tuple(mark.pair.id for mark in acting),
        np.array([mark.source_face for mark in acting], dtype=np.int64),
        np.array([mark.source_corners for mark in acting]).reshape(-1, 3),
        np.array([mark.target_point for mark in acting]).reshape(-1, 3),
    )


def build_locators(target: FlatBrain) -> Locators:
    """Return the locators of both halves and both caps of the target."""
    caps = find_caps(target.dissection, target.curves, target.added)
    grids = [cap_grid(cap, lay_cap_flat(cap, rim_circle(cap.side, target.curves))) for cap in caps]
    points = target.dissection.surface.vertices
    halves = both_halves(lambda half, _: strip_grid(target.halves[half].flat))
    return Locators(
        halves,
        {half: _corners_on_surface(target.halves[half], points) for half in HALVES},
        (grids[0], grids[1]),
        (_corners_on_surface(caps[0], points), _corners_on_surface(caps[1], points)),
    )


def register(
    source: FlatBrain,
    source_caps: tuple[Cap, Cap],
    target: FlatBrain,
    locators: Locators,
    places: Mapping[HalfName, Floats],
    ends: LandmarkEnds,
    report: Report,
    last: Registration | None = None,
) -> Registration:
    """Return the source's surface carried onto the target by one spline per half.

    Parameters
    ----------
    places : half -> (k, 2) float
        Where the half's spline takes its vertices in the target's rectangle.
    last : Registration, optional
        Of the same two brains: where vertices lay then, they are looked for first.

    Notes
    -----
    A warped vertex lies in a flat target triangle and takes its barycentric coordinates there to
    the surface (eq. 11-13). Boundary vertices go along their curves, both halves alike; what this
    changes at the boundary fades out linearly towards the other one. Folds that remain are mended
    (`unfold`).
    """
    report(0.0, "lifting")
    warped = {half: to_strip(places[half], source.halves[half].flat.uv[:, 0]) for half in HALVES}
    shifts = {half: warped[half][0] for half in HALVES}
    mapped = map_boundaries(source, shifts)
    sewn = {key: target.curves[key].at(shares) for key, shares in mapped.items()}
    vertices = np.zeros_like(source.dissection.surface.vertices)

    def carry_half(half: HalfName, report: Report) -> WarpedHalf:
        own, other = source.halves[half], target.halves[half]
        raw = _warp_half(own, other, warped[half], mapped)
        mended = unfold(raw, own.net, own.is_boundary, report)
        near = None if last is None else last.halves[half].face
        grid, corners = locators.halves[half], locators.corners[half]
        face = _lift_into(vertices, own.vertex_of, mended.flat.uv, half, grid, corners, near)
        gaps = seam_gaps(source, target, half, shifts[half], sewn)
        return _warped_half(raw, mended, other.law, face, gaps)

    def carry_one_cap(number: int) -> CarriedCap:
        cap, near = source_caps[number], None if last is None else last.caps[number].face
        onto = target.curves, locators.cap_grids[number], locators.cap_corners[number]
        vertices[cap.vertex_of], carried = carry_cap(cap, mapped, *onto, near)
        return carried

    def carry(half: HalfName, report: Report) -> tuple[WarpedHalf, CarriedCap]:
        """Carry a half and, so that both halves are as much work, one of the caps."""
        return carry_half(half, report), carry_one_cap(HALVES.index(half))

    carried = both_halves(carry, report)
    halves = {half: warped for half, (warped, _) in carried.items()}
    # halves and caps all wrote the vertices that they share; the curves say where these lie
    for key, curve in source.curves.items():
        vertices[curve.vertices] = sewn[key]
    vertices.setflags(write=False)
    surface = source.dissection.surface.moved(vertices)
    caps = carried[HALVES[0]][1], carried[HALVES[1]][1]
    return Registration(surface, halves, caps, _residuals(surface, ends))


def lift(
    uv: Floats,
    target: FlatHalf,
    grid: TriangleGrid,
    points: Floats,
) -> Floats:
    """Return the (k, 3) surface points of (k, 2) strip coordinates on a half (eq. 13)."""
    lifted = np.zeros((len(uv), 3))
    corners = _corners_on_surface(target, points)
    _lift_into(lifted, np.arange(len(uv)), uv, target.name, grid, corners, None)
    return lifted


def lift_places(
    half: HalfName, brain: FlatBrain, grid: TriangleGrid, places: Floats, surface: Floats
) -> Floats:
    """Return the (k, 3) points of a brain's surface at (k, 2) places of the rectangle."""
    other = brain.halves[half]
    u, beta = from_plane(places)
    uv = np.stack([u, other.law.v(np.clip(beta, 0.0, 1.0))], axis=1)
    return lift(uv, other, grid, surface)


def _corners_on_surface(piece: FlatHalf | Cap, points: Floats) -> Floats:
    """Return (m, 3, 3) where the corners of the faces of a half or a cap lie, of the surface's points."""
    return points[piece.vertex_of[piece.faces]]


def _lift_into(
    lifted: Floats,
    rows: Integers,
    uv: Floats,
    name: HalfName,
    grid: TriangleGrid,
    corners: Floats,
    near: Integers | None,
) -> Integers:
    """Write the surface points of strip coordinates into some rows; return the faces they lie in.

    Faces are looked for `near` first.
    """
    face, barycentric = find_triangles(grid, once_around(uv) if near is None else uv, near)
    lost = int((face < 0).sum())
    if lost:
        raise ValueError(f"{lost} flat places lie in no triangle of the {name} half")
    _write_points(face, barycentric, corners, rows, lifted)
    return face


@njit(nogil=True, cache=True)
def _write_points(
    face: Integers, barycentric: Floats, corners: Floats, rows: Integers, lifted: Floats
) -> None:
    for k in range(len(face)):
        t, row = face[k], rows[k]
        a, b, c = barycentric[k, 0], barycentric[k, 1], barycentric[k, 2]
        for i in range(3):
            lifted[row, i] = a * corners[t, 0, i] + b * corners[t, 1, i] + c * corners[t, 2, i]


def _warp_half(
    source: FlatHalf,
    target: FlatHalf,
    warped: tuple[Floats, Floats],
    mapped: Mapping[CurveKey, Floats],
) -> FlatMesh:
    """Return a half after the spline on the target's strip, its boundary on the target's curves."""
    shift, beta = warped
    start = source.flat.uv[:, 0]
    goals = {
        key: u_of_perimeter(source.name, perimeter_share(key[0], share))
        for key, share in mapped.items()
    }
    boundaries = (
        (source.outer, along_outer(source.name, goals), 1.0),
        (source.hole, goals["hole", None][:-1], 0.0),
    )
    misses = [
        np.stack([wrapped(goal - start[loop] - shift[loop]), edge - beta[loop]], axis=1)
        for loop, goal, edge in boundaries
    ]
    uv = draw_along(start, shift, beta, source.fadings, (misses[0], misses[1]))
    uv[:, 1] = target.law.v(np.clip(uv[:, 1], CLOSEST_TO_BOUNDARY, 1 - CLOSEST_TO_BOUNDARY))
    for (loop, _, edge), miss in zip(boundaries, misses, strict=True):
        uv[loop, 0] = start[loop] + shift[loop] + miss[:, 0]
        uv[loop, 1] = edge
    uv.setflags(write=False)
    return source.flat.moved(uv)


def _warped_half(
    raw: FlatMesh,
    mended: Unfolded,
    law: RadialLaw,
    face: Integers,
    gaps_um: Mapping[CurveKey, Floats],
) -> WarpedHalf:
    is_mended = np.zeros(len(raw.uv), dtype=bool)
    if mended.folds:
        changed = mended.flat.uv != raw.uv
        is_mended = changed[:, 0] | changed[:, 1]
    return WarpedHalf(mended.flat, law, face, mended.folds, is_mended, mended.flipped, gaps_um)


def _residuals(registered: SurfaceMesh, ends: LandmarkEnds) -> Mapping[str, float]:
    """Return how far from its target each acting landmark's source place ended, micrometres."""
    corners = registered.vertices[registered.faces[ends.faces]]
    landed = np.einsum("ij,ijk->ik", ends.barycentric, corners)
    away = np.linalg.norm(landed - ends.targets, axis=1)
    return dict(zip(ends.ids, away.tolist(), strict=True))
