"""The five named boundary curves of a half, and the arc length along them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flyreg_core.cut import PIECES, Dissection
from flyreg_core.errors import TopologyError
from flyreg_core.frame import DORSO_VENTRAL, LEFT_RIGHT, BrainFrame
from flyreg_core.landmarks import HALVES, SHARED_CURVES, CurveName, HalfName
from flyreg_core.mesh import Floats, Integers
from flyreg_core.rectangle import TOP, from_plane
from flyreg_core.topology import boundary_loops, half_edges

CurveKey = tuple[CurveName, HalfName | None]
"""A curve's name, and the half it belongs to unless both halves share it."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A chain of edges between two corners, or once around the hole (first vertex = last)."""

    vertices: Integers  # (k,), numbers in the whole surface, in the direction `LandmarkPair` states
    share: Floats  # (k,), share of arc length, 0 to 1; on the hole 0 is its top, so it starts off 0
    points: Floats  # (k, 3), micrometres

    def at(self, share: Floats) -> Floats:
        """Return the (n, 3) points at shares of the arc length."""
        first = self.share[0]
        place = first + np.mod(share - first, 1.0) if self.is_closed else share
        return np.stack([np.interp(place, self.share, self.points[:, i]) for i in range(3)], -1)

    def nearest(self, point: Floats) -> tuple[float, float]:
        """Return the share at the place of the curve nearest to a (3,) point, and its distance."""
        edges, parts, away = nearest_on_chain(point[np.newaxis], self.points)
        edge = edges[0]
        share = self.share[edge] + parts[0] * (self.share[edge + 1] - self.share[edge])
        return float(share % 1.0 if self.is_closed else share), float(away[0])

    @property
    def is_closed(self) -> bool:
        """Tell whether the curve runs once around."""
        return bool(self.vertices[0] == self.vertices[-1])

    @property
    def length(self) -> float:
        """Arc length, micrometres."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())


def nearest_on_chain(points: Floats, chain: Floats) -> tuple[Integers, Floats, Floats]:
    """Return for (k, 3) points the nearest of the edges between (c, 3) points, and where on it.

    Returns
    -------
    (k,) int, (k,) float, (k,) float
        The edges, the places on them as shares of their length, and how far the points are from there.
    """
    start, along = chain[:-1], np.diff(chain, axis=0)
    squared = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    arm = points[:, np.newaxis] - start
    parts = np.clip((arm * along).sum(axis=-1) / squared, 0.0, 1.0)
    away = np.linalg.norm(start + parts[..., np.newaxis] * along - points[:, np.newaxis], axis=-1)
    each, edges = np.arange(len(points)), away.argmin(axis=1)
    return edges, parts[each, edges], away[each, edges]


def curve_key(curve: CurveName, half: HalfName) -> CurveKey:
    """Return the key under which a half's curve is kept."""
    return (curve, None) if curve in SHARED_CURVES else (curve, half)


def find_curves(dissection: Dissection, frame: BrainFrame) -> Mapping[CurveKey, Curve]:
    """Return the boundary curves of both halves: upper, lower, hole, and left and right of each.

    Raises
    ------
    TopologyError
        A half's outside does not consist of two seams and two trim openings in turn.
    """
    curves: dict[CurveKey, Curve] = {}
    for half in HALVES:
        outer, hole = _outer_and_hole(dissection, half)
        for (name, key_half), vertices in _sides(dissection, frame, half, outer).items():
            curves.setdefault((name, key_half), _curve(dissection, vertices, 0.0))
        if half == "anterior":
            closed = np.append(hole, hole[0])
            open_share = _curve(dissection, closed, 0.0)
            start = _start_of_hole(open_share, frame)
            curves["hole", None] = _curve(dissection, closed, start)
    return curves


def _outer_and_hole(dissection: Dissection, half: HalfName) -> tuple[Integers, Integers]:
    loops = boundary_loops(dissection.faces_of(half))
    on_caps = np.zeros(len(dissection.surface.vertices), dtype=bool)
    on_caps[dissection.surface.faces[np.isin(dissection.piece_of_face, [2, 3])]] = True
    outer = [loop for loop in loops if on_caps[loop].any()]
    hole = [loop for loop in loops if not on_caps[loop].any()]
    if len(outer) != 1 or len(hole) != 1:
        raise TopologyError(
            f"the {half} half has {len(outer)} boundaries at the trim openings and {len(hole)} in "
            "the oesophagus instead of one each; move the cut height or the trim planes"
        )
    return outer[0], hole[0]


def _sides(
    dissection: Dissection, frame: BrainFrame, half: HalfName, loop: Integers
) -> dict[CurveKey, Integers]:
    """Return the four sides of a half's outer boundary, each in its canonical direction."""
    beyond = _piece_beyond(dissection, loop)
    changes = np.flatnonzero(beyond != np.roll(beyond, 1))
    runs = [
        (int(beyond[start]), np.take(loop, np.arange(start, end + 1), mode="wrap"))
        for start, end in zip(changes, np.append(changes[1:], changes[:1] + len(loop)), strict=True)
    ]
    seam = PIECES.index("posterior" if half == "anterior" else "anterior")
    seams = [run for piece, run in runs if piece == seam]
    rims = {piece: run for piece, run in runs if piece != seam}
    if len(runs) != 4 or len(seams) != 2 or len(rims) != 2:
        raise TopologyError(
            f"the outside of the {half} half has {len(runs)} sides instead of 4: the cut must pass "
            "each trim opening once; move the cut height or the trim planes"
        )
    height = frame.coordinates(dissection.surface.vertices)[:, DORSO_VENTRAL]
    seams.sort(key=lambda run: float(height[run].mean()))
    right, left = rims[PIECES.index("right cap")], rims[PIECES.index("left cap")]
    corners_right = {int(right[0]), int(right[-1])}
    upper_corners = {int(seams[0][0]), int(seams[0][-1])}
    return {
        ("upper", None): _from(seams[0], corners_right),
        ("lower", None): _from(seams[1], corners_right),
        ("left", half): _from(left, upper_corners),
        ("right", half): _from(right, upper_corners),
    }


def _piece_beyond(dissection: Dissection, loop: Integers) -> Integers:
    """Return the piece on the other side of each edge from a loop's vertex to the next."""
    n = len(dissection.surface.vertices)
    directed = half_edges(dissection.surface.faces)
    key = directed[:, 0] * n + directed[:, 1]
    order = np.argsort(key)
    wanted = np.roll(loop, -1) * n + loop
    face = order[np.searchsorted(key[order], wanted)] % len(dissection.surface.faces)
    return np.asarray(dissection.piece_of_face[face])


def _from(run: Integers, starts: set[int]) -> Integers:
    return run if int(run[0]) in starts else run[::-1]


def _curve(dissection: Dissection, vertices: Integers, start: float) -> Curve:
    points = dissection.surface.vertices[vertices]
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return Curve(vertices, start + along / along[-1], points)


def _start_of_hole(curve: Curve, frame: BrainFrame) -> float:
    """Return the share of the hole's first vertex, 0 being its top and left a quarter on.

    The shares are turned so that, on average, each point lies in the direction in which the
    rectangle shows it.
    """
    across = frame.coordinates(curve.points[:-1])[:, [LEFT_RIGHT, DORSO_VENTRAL]]
    arm = across - across.mean(axis=0)
    u, _ = from_plane(arm * [1.0, -1.0])
    turn = np.exp(2j * np.pi * (u - TOP - curve.share[:-1]))
    step = np.diff(curve.share)
    return float(np.angle((turn * (step + np.roll(step, 1))).sum()) / (2 * np.pi))
