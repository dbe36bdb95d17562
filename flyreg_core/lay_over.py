"""Stage 5b: a source's halves laid flat so that what belongs together by shape lies in one place.

Each brain laid flat alone shows its own pockets and folds; the same anatomy then lies in different
places of the two rectangles, which no smooth spline of the plane can mend. Here the source is laid
on the target's flat halves instead, vertex by vertex, as the shape map tells; the spline starts from
there, and moves what landmarks say beyond that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import scipy
from scipy.spatial import KDTree

from flyreg_core.boundary import Curve, CurveKey
from flyreg_core.boundary_map import LEAST_ADVANCE, advance_around
from flyreg_core.correspondence import FlatBrain
from flyreg_core.cut import PIECES
from flyreg_core.flatten import Springs, find_crowding, solve_means
from flyreg_core.halves import FlatHalf, along_outer
from flyreg_core.landmarks import HALVES, HalfName
from flyreg_core.mesh import Booleans, FlatMesh, Floats, SurfaceMesh
from flyreg_core.progress import Report, within
from flyreg_core.rectangle import perimeter_share, u_of_perimeter, wrapped
from flyreg_core.shape_map import ShapeMap
from flyreg_core.surface_places import SurfacePlaces, find_places
from flyreg_core.unfold import Net, unfold

LEAST_LIKENESS = 0.5
"""Cosine of the largest angle between surfaces that belong together."""
TOLERANCE = 3.0
"""Places so many medians off the target's surface have no partner there."""
FARTHEST_TURN = 0.3
"""Places that would move farther around the hole, in whole turns, have no partner."""
LEAST_SLOPE = 0.1
"""Least growth of a share along a curve; places that crowd more cannot be told apart flat."""
MOST_ROUNDS = 4
"""How often what rounding turns over, in pockets that crowd too much, is given more room."""
CURVE_STEPS = 2000
"""Places along a target's curve among which the nearest is looked for."""


def find_partners(
    points: Floats, normals: Floats, target: FlatBrain, to_target: ShapeMap
) -> tuple[SurfacePlaces, Booleans]:
    """Return the places of the target next to where (n, 3) points of a source come to lie.

    Parameters
    ----------
    normals : (n, 3) float
        Unit normals of the source's surface at the points.

    Returns
    -------
    SurfacePlaces, (n,) bool
        The places on the target's surface, and whether both surfaces look the same way there.
    """
    surface = target.dissection.surface
    places = find_places(to_target(points), surface)
    there = places.carried(target.normals, surface.faces)
    likeness = (to_target.turned(points, normals) * there).sum(axis=1)
    length = np.maximum(np.linalg.norm(there, axis=1), np.finfo(float).tiny)
    return places, likeness / length > LEAST_LIKENESS


def lay_over(
    source: FlatBrain, target: FlatBrain, to_target: ShapeMap, report: Report
) -> FlatBrain:
    """Return the source with its halves and curves laid on those of the target.

    Notes
    -----
    Vertices without a partner, in pockets that the target has not, are the weighted means of their
    neighbours, as in `flatten`. Where partners fold the surface it is laid flat anew (`unfold`).
    """
    curves = {
        key: _share_by_shape(curve, target.curves[key], to_target)
        for key, curve in source.curves.items()
    }
    halves = {
        half: _lay_half(
            *(half, source, curves, target, to_target),
            within(report, number / 2, (number + 1) / 2),
        )
        for number, half in enumerate(HALVES)
    }
    return replace(source, curves=curves, halves=halves)


def _share_by_shape(curve: Curve, target: Curve, to_target: ShapeMap) -> Curve:
    """Return a curve whose vertices have the shares of the places next to them on the target's."""
    evenly = np.linspace(target.share[0], target.share[-1], CURVE_STEPS)
    shares = np.union1d(evenly, target.share)
    nearest = KDTree(target.at(shares)).query(to_target(curve.points))[1]
    if not curve.is_closed:
        growing = np.clip(_growing(curve.share, shares[nearest]), 0, 1)
        growing[[0, -1]] = 0.0, 1.0
        return replace(curve, share=(1 - LEAST_ADVANCE) * growing + LEAST_ADVANCE * curve.share)
    shift = wrapped(shares[nearest] - curve.share)[:-1]
    middle = np.angle(np.exp(2j * np.pi * shift).mean()) / (2 * np.pi)
    shift = middle + wrapped(shift - middle)
    thrice = np.concatenate([curve.share[:-1] + turn for turn in (-1, 0, 1)])
    once = _growing(thrice, thrice + np.tile(shift, 3))[len(shift) : 2 * len(shift)]
    moved = np.append(once, once[0] + 1) - curve.share
    return replace(curve, share=advance_around(curve.share, moved))


def _growing(share: Floats, goal: Floats) -> Floats:
    """Return the shares nearest to goals that grow everywhere, at least a little."""
    length = np.gradient(share)  # a vertex counts for the part of the curve that it stands for
    steep = scipy.optimize.isotonic_regression(goal - LEAST_SLOPE * share, weights=length).x
    return np.asarray(LEAST_SLOPE * share + steep)


def _lay_half(
    half: HalfName,
    source: FlatBrain,
    curves: Mapping[CurveKey, Curve],
    target: FlatBrain,
    to_target: ShapeMap,
    report: Report,
) -> FlatHalf:
    report(0.0, "laying the source over the target")
    own = source.halves[half]
    uv, is_sure = _places_of_partners(half, source, target, to_target)
    outer_share = along_outer(
        half, {key: perimeter_share(key[0], curve.share) for key, curve in curves.items()}
    )
    hole_share = perimeter_share("hole", curves["hole", None].share[:-1])
    for loop, share, edge in ((own.outer, outer_share, 1.0), (own.hole, hole_share, 0.0)):
        start = own.flat.uv[loop, 0]
        uv[loop, 0] = start + wrapped(u_of_perimeter(half, share) - start)
        uv[loop, 1] = edge
    face_areas = SurfaceMesh(
        source.dissection.surface.vertices[own.vertex_of], own.faces
    ).face_areas
    flat, springs = _without_folds(own, uv, is_sure, face_areas, report)
    law = target.halves[half].law
    return replace(
        own, flat=flat, springs=springs, law=law, outer_share=outer_share, hole_share=hole_share
    )


def _places_of_partners(
    half: HalfName, source: FlatBrain, target: FlatBrain, to_target: ShapeMap
) -> tuple[Floats, Booleans]:
    """Return (k, 2) where a half's vertices belong on the target's strip, and which are sure of it."""
    own, surface = source.halves[half], source.dissection.surface
    points, normals = surface.vertices[own.vertex_of], source.normals[own.vertex_of]
    partners, is_sure = find_partners(points, normals, target, to_target)
    in_half = target.dissection.piece_of_face == PIECES.index(half)
    is_sure &= in_half[partners.face]
    is_sure &= partners.apart_um <= TOLERANCE * float(np.median(partners.apart_um))
    uv = own.flat.uv.copy()
    corners = target.halves[half].flat.corners[target.dissection.own_face[partners.face[is_sure]]]
    place = np.einsum("ij,ijk->ik", partners.barycentric[is_sure], corners)
    turn = wrapped(place[:, 0] - uv[is_sure, 0])
    uv[is_sure] = np.stack([uv[is_sure, 0] + turn, place[:, 1]], axis=1)
    is_sure[np.flatnonzero(is_sure)[np.abs(turn) > FARTHEST_TURN]] = False
    return uv, is_sure


def _without_folds(
    own: FlatHalf,
    uv: Floats,
    is_sure: Booleans,
    face_areas: Floats,
    report: Report,
) -> tuple[FlatMesh, Springs]:
    """Return a half laid flat with its sure vertices where they belong, and the springs that hold it."""
    springs = own.springs
    for done in range(MOST_ROUNDS):
        part = within(report, done / MOST_ROUNDS, (done + 1) / MOST_ROUNDS)
        u, v = solve_means(springs, own.is_boundary | is_sure, *uv.T)
        flat = FlatMesh(np.stack([u, v], axis=1), own.faces, own.flat.corner_shifts)
        mended = unfold(flat, Net(springs, own.faces), own.is_boundary, part)
        flat = mended.flat
        if mended.flipped == 0:
            break
        crowding = find_crowding(flat, springs.edges, face_areas)
        springs = Springs(springs.edges, springs.jumps, springs.weights * crowding)
    return flat, springs
