"""Where the spline carries the boundary curves: each along its own curve, equally in both halves."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flyreg_core.boundary import CurveKey
from flyreg_core.correspondence import FlatBrain
from flyreg_core.landmarks import HALVES, HalfName
from flyreg_core.mesh import Floats
from flyreg_core.rectangle import STARTS

LEAST_ADVANCE = 1e-3
"""Share of the unmoved parametrisation mixed in, so that no two vertices meet."""


def map_boundaries(
    source: FlatBrain, shift_of_u: Mapping[HalfName, Floats]
) -> Mapping[CurveKey, Floats]:
    """Return for each source curve the target shares of arc length to which its vertices go.

    Parameters
    ----------
    shift_of_u : half -> (k,) float
        How far the half's spline moves each vertex in u.

    Notes
    -----
    On a curve that both halves share, the mean of both counts, so the halves stay sewn. Corners
    go to corners. Shares grow along the curve: where the spline would turn back, vertices are held
    just behind the foremost one.
    """
    mapped: dict[CurveKey, Floats] = {}
    for key, curve in source.curves.items():
        own = [
            _own_shift(source, key, half, shift_of_u[half])
            for half in HALVES
            if key in source.rows_of_curves[half]
        ]
        shift = np.mean(own, axis=0)
        mapped[key] = (
            advance_around(curve.share, shift)
            if curve.is_closed
            else _advance(curve.share, shift - np.interp(curve.share, [0, 1], shift[[0, -1]]))
        )
    return mapped


def seam_gaps(
    source: FlatBrain,
    target: FlatBrain,
    half: HalfName,
    shift: Floats,
    sewn: Mapping[CurveKey, Floats],
) -> Mapping[CurveKey, Floats]:
    """Return how far sewing moved a half along the target's curves, micrometres.

    For each of its curves, (k,) values at the curve's vertices, which came to lie at the (k, 3)
    points `sewn`; its spline moves its vertices by (n,) `shift` in u.
    """
    gaps: dict[CurveKey, Floats] = {}
    for key in source.rows_of_curves[half]:
        curve = source.curves[key]
        alone = curve.share + _own_shift(source, key, half, shift)
        alone = alone if curve.is_closed else np.clip(alone, 0, 1)
        gaps[key] = np.linalg.norm(target.curves[key].at(alone) - sewn[key], axis=1)
    return gaps


def _own_shift(source: FlatBrain, key: CurveKey, half: HalfName, shift: Floats) -> Floats:
    """Return by how much of its arc length a half moves the vertices of one of its curves."""
    seen_from_front = 1 if half == "anterior" else -1
    rows = source.rows_of_curves[half][key]
    return np.asarray(seen_from_front * shift[rows] / STARTS[key[0]][1])


def _advance(share: Floats, shift: Floats) -> Floats:
    """Return shares moved along an open curve, strictly growing, its ends kept."""
    foremost = np.maximum.accumulate(np.clip(share + shift, 0, 1))
    moved = (1 - LEAST_ADVANCE) * foremost + LEAST_ADVANCE * share
    moved[[0, -1]] = share[[0, -1]]
    return np.asarray(moved)


def advance_around(share: Floats, shift: Floats) -> Floats:
    """Return shares moved along a closed curve (last vertex = first), strictly growing."""
    shift = shift[:-1]
    start = int(np.argmax(shift))
    around = np.roll(share[:-1], -start) + np.where(
        np.arange(len(shift)) >= len(shift) - start, 1, 0
    )
    foremost = np.maximum.accumulate(around + np.roll(shift, -start))
    foremost = np.minimum(foremost, around[0] + shift[start] + 1)
    offset = shift[start]
    moved = (1 - LEAST_ADVANCE) * foremost + LEAST_ADVANCE * (around + offset)
    moved = np.roll(moved - np.where(np.arange(len(shift)) >= len(shift) - start, 1, 0), start)
    return np.append(moved, moved[0] + 1)
