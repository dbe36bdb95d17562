"""Landmark pairs that the program suggests: places all over both halves, paired by shape alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flyreg_core.correspondence import FlatBrain
from flyreg_core.cut import PIECES
from flyreg_core.errors import LandmarkError
from flyreg_core.landmarks import HALVES, SUGGESTED, HalfName, LandmarkPair
from flyreg_core.lay_over import TOLERANCE, find_partners
from flyreg_core.mesh import Floats, Integers
from flyreg_core.shape_map import ShapeMap
from flyreg_core.spread_out import spread_out

STRONGEST = 0.1
"""Weight of a suggestion that is quite sure, so that a pair of the user's own wins over it."""

LEAST_LIMIT_UM = 1e-6
"""Ends so near are in one place, as those of a brain that is registered to itself."""


def suggest_pairs(
    source: FlatBrain, target: FlatBrain, to_target: ShapeMap, per_half: int
) -> tuple[LandmarkPair, ...]:
    """Return up to `per_half` interior pairs for each half, weighted by how sure they are.

    A place of the source is paired with the place of the target's surface next to where the shape
    map takes it, if the surfaces there look the same way and both lie on the same half. The farther
    the two are apart the less the pair weighs (Tukey's biweight).

    Raises
    ------
    LandmarkError
        A negative number of pairs is asked for.
    """
    if per_half < 0:
        raise LandmarkError(f"the number of suggested landmarks must be at least 0, not {per_half}")
    return tuple(
        pair for half in HALVES for pair in _suggest_in(half, source, target, to_target, per_half)
    )


def turned_round(pairs: tuple[LandmarkPair, ...]) -> tuple[LandmarkPair, ...]:
    """Return pairs from the target to the source."""
    return tuple(replace(pair, source=pair.target, target=pair.source) for pair in pairs)


def _suggest_in(
    half: HalfName, source: FlatBrain, target: FlatBrain, to_target: ShapeMap, count: int
) -> list[LandmarkPair]:
    chosen = _inner_places(source, half, count)
    if len(chosen) == 0:
        return []
    surface = source.dissection.surface
    points = surface.vertices[chosen]
    normals = source.normals[chosen]
    partners, is_alike = find_partners(points, normals, target, to_target)
    piece = target.dissection.piece_of_face[partners.face]
    limit = max(TOLERANCE * float(np.median(partners.apart_um)), LEAST_LIMIT_UM)
    is_kept = is_alike & (piece == PIECES.index(half)) & (partners.apart_um < limit)
    weights = STRONGEST * (1 - (partners.apart_um / limit) ** 2) ** 2
    return [
        LandmarkPair(
            id=f"suggested-{half}-{place + 1:03d}",
            name=f"{SUGGESTED}{half} {place + 1}",
            kind="interior",
            half=None,
            source=_point(points[place]),
            target=_point(partners.points[place]),
            weight=float(weights[place]),
            origin="suggested",
        )
        for place in np.flatnonzero(is_kept)
    ]


def _inner_places(brain: FlatBrain, name: HalfName, count: int) -> Integers:
    """Return vertices spread evenly over a half, none on its boundaries.

    They are the same ones however edges were divided.
    """
    half = brain.halves[name]
    inner = half.vertex_of[~half.is_boundary]
    inner = inner[inner < len(brain.dissection.surface.vertices) - len(brain.added)]
    if count == 0:
        return inner[:0]
    return np.asarray(inner[spread_out(brain.dissection.surface.vertices[inner], count)])


def _point(place: Floats) -> tuple[float, float, float]:
    return float(place[0]), float(place[1]), float(place[2])
