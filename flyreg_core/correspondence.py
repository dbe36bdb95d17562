"""Which places belong together: pairs along the boundary curves, and where each pair lies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import igl
import numpy as np

from flyreg_core.boundary import Curve, CurveKey, curve_key
from flyreg_core.cut import PIECES, Dissection
from flyreg_core.errors import LandmarkError
from flyreg_core.frame import DORSO_VENTRAL, LEFT_RIGHT, BrainFrame
from flyreg_core.halves import FlatHalf
from flyreg_core.landmarks import (
    HALVES,
    SHARED_CURVES,
    CurveName,
    HalfName,
    LandmarkPair,
    LandmarkParameters,
    Pairing,
)
from flyreg_core.mesh import Floats, Integers
from flyreg_core.rectangle import perimeter_share, to_plane, u_of_perimeter, wrapped
from flyreg_core.refine import AddedVertices, no_vertices
from flyreg_core.surface_places import find_places

LENGTH_SHARE = 0.1
"""Share of arc length mixed into coordinate pairing, so that a curve that turns back still advances."""


@dataclass(frozen=True, eq=False)
class FlatBrain:
    """A prepared brain: dissected, its curves named, its halves laid flat."""

    dissection: Dissection
    frame: BrainFrame
    curves: Mapping[CurveKey, Curve]
    halves: Mapping[HalfName, FlatHalf]
    added: AddedVertices = field(default_factory=no_vertices)

    @cached_property
    def normals(self) -> Floats:
        """(n, 3) unit normals of the surface's vertices, outwards in the file too if it is mirrored."""
        return self.frame.outwards * self.dissection.surface.vertex_normals

    @cached_property
    def rows_of_curves(self) -> Mapping[HalfName, Mapping[CurveKey, Integers]]:
        """Which of a half's own vertices lie on each of its curves, in the curve's order."""
        return {
            half: {
                key: np.searchsorted(flat.vertex_of, curve.vertices)
                for key, curve in self.curves.items()
                if curve_key(key[0], half) == key
            }
            for half, flat in self.halves.items()
        }


@dataclass(frozen=True, eq=False)
class PlacedLandmark:
    """A pair with its places on both surfaces and in the rectangles of the halves it acts in."""

    pair: LandmarkPair
    source_point: Floats  # (3,), micrometres
    target_point: Floats  # (3,)
    source_face: int  # where the source point lies on the source's surface
    source_corners: Floats  # (3,) its barycentric coordinates there
    plane: Mapping[HalfName, tuple[Floats, Floats]]  # source and target (2,); empty: not usable
    is_muted: bool = False  # the pair keeps its weight, but does not pull

    @property
    def weight(self) -> float:
        """How strongly the pair pulls here and now."""
        return 0.0 if self.is_muted else self.pair.weight


def boundary_pairs(
    source: FlatBrain, target: FlatBrain, parameters: LandmarkParameters
) -> tuple[LandmarkPair, ...]:
    """Return the corners and the pairs along the curves, all of weight 1.

    Ids depend on the parameters only, so that a weight given to one stays with it.
    """
    if parameters.per_seam < 1 or parameters.per_side < 0:
        raise LandmarkError(
            f"at least one landmark per seam and none per side are needed, not {parameters.per_seam} "
            f"and {parameters.per_side}"
        )
    pairs = [_corner(curve, end) for curve in ("upper", "lower") for end in (0.0, 1.0)]
    for name, half in source.curves:
        shares = _source_shares(source.curves[name, half], name, parameters)
        partners = _partners(source, target, (name, half), shares, parameters.pairing)
        label = name if half is None else f"{half} {name}"
        for number, (share, partner) in enumerate(zip(shares, partners, strict=True), 1):
            pairs.append(
                LandmarkPair(
                    id=f"{label.replace(' ', '-')}-{number:02d}",
                    name=f"{label} {number}",
                    kind=name,
                    half=half,
                    source=float(share),
                    target=float(partner),
                    origin="boundary",
                )
            )
    return tuple(pairs)


def _corner(curve: Literal["upper", "lower"], end: float) -> LandmarkPair:
    side = "left" if end else "right"
    return LandmarkPair(
        id=f"corner-{curve}-{side}",
        name=f"{curve} {side} corner",
        kind=curve,
        half=None,
        source=end,
        target=end,
        origin="boundary",
    )


def _source_shares(curve: Curve, name: CurveName, parameters: LandmarkParameters) -> Floats:
    if parameters.pairing == "nearest":
        return curve.share[:-1] if curve.is_closed else curve.share[1:-1]
    if curve.is_closed:
        return np.arange(parameters.per_seam) / parameters.per_seam
    count = parameters.per_seam if name in SHARED_CURVES else parameters.per_side
    return np.arange(1, count + 1) / (count + 1)


def _partners(
    source: FlatBrain,
    target: FlatBrain,
    key: CurveKey,
    shares: Floats,
    pairing: Pairing,
) -> Floats:
    """Return the shares on the target's curve that belong to shares on the source's."""
    if pairing == "nearest":
        choices = target.curves[key].share
        away = shares[:, None] - choices[None]
        away = wrapped(away) if target.curves[key].is_closed else away
        return np.asarray(choices[np.abs(away).argmin(axis=1)])
    if pairing in ("shape", "arc length") or key[0] == "hole":
        return shares
    progress_source = _progress(source.curves[key], key[0], source.frame)
    progress_target = _progress(target.curves[key], key[0], target.frame)
    progress = np.interp(shares, source.curves[key].share, progress_source)
    return np.interp(progress, progress_target, target.curves[key].share)


def _progress(curve: Curve, name: CurveName, frame: BrainFrame) -> Floats:
    """Return how far along the animal's axis each vertex of a curve lies, growing from 0 to 1."""
    axis = LEFT_RIGHT if name in ("upper", "lower") else DORSO_VENTRAL
    forward = np.maximum(np.diff(frame.coordinates(curve.points)[:, axis]), 0)
    total = max(float(forward.sum()), np.finfo(float).tiny)
    steps = (1 - LENGTH_SHARE) * forward / total + LENGTH_SHARE * np.diff(curve.share)
    progress = np.concatenate([[0.0], np.cumsum(steps)])
    return np.asarray(progress / progress[-1])


def with_decisions(
    pairs: tuple[LandmarkPair, ...], weights: Mapping[str, float], moved: Mapping[str, float]
) -> tuple[LandmarkPair, ...]:
    """Return boundary pairs with the user's weights and moved target places; the others as they are."""
    return tuple(
        replace(
            pair, weight=weights.get(pair.id, pair.weight), target=moved.get(pair.id, pair.target)
        )
        if pair.id in weights or pair.id in moved
        else pair
        for pair in pairs
    )


def place_landmarks(
    source: FlatBrain, target: FlatBrain, pairs: tuple[LandmarkPair, ...]
) -> tuple[PlacedLandmark, ...]:
    """Return each complete pair with its places; an interior one moves to the nearest surface point.

    An interior pair whose ends lie on different halves, or on what the trim planes cut off, gets
    an empty `plane` and does not act.
    """
    complete = [pair for pair in pairs if pair.is_placed]
    if not complete:
        return ()
    interior = [pair for pair in complete if pair.kind == "interior"]
    sources = _place_interior(source, np.array([pair.source for pair in interior]).reshape(-1, 3))
    targets = _place_interior(target, np.array([pair.target for pair in interior]).reshape(-1, 3))
    ends = {pair.id: both for pair, *both in zip(interior, sources, targets, strict=True)}
    points, planes = [], []
    for pair in complete:
        if pair.kind == "interior":
            (from_half, from_point, start), (to_half, to_point, end) = ends[pair.id]
            points.append((from_point, to_point))
            planes.append({from_half: (start, end)} if from_half and from_half == to_half else {})
        else:
            points.append(_boundary_points(source, target, pair))
            planes.append(_boundary_planes(pair))
    starts = np.array([start for start, _ in points]).reshape(-1, 3)
    places = find_places(starts, source.dissection.surface)
    return tuple(
        PlacedLandmark(pair, start, end, int(face), corner, plane)
        for pair, (start, end), face, corner, plane in zip(
            complete, points, places.face, places.barycentric, planes, strict=True
        )
    )


def _boundary_points(
    source: FlatBrain, target: FlatBrain, pair: LandmarkPair
) -> tuple[Floats, Floats]:
    key = _key(pair)
    ends = np.array([pair.source, pair.target])
    return source.curves[key].at(ends[:1])[0], target.curves[key].at(ends[1:])[0]


def _boundary_planes(pair: LandmarkPair) -> dict[HalfName, tuple[Floats, Floats]]:
    name, own_half = _key(pair)
    share = perimeter_share(name, np.array([pair.source, pair.target]))
    beta = np.full(2, 0.0 if name == "hole" else 1.0)
    planes = {}
    for half in HALVES if own_half is None else (own_half,):
        start, end = to_plane(u_of_perimeter(half, share), beta)
        planes[half] = (start, end)
    return planes


def _key(pair: LandmarkPair) -> CurveKey:
    if pair.kind == "interior":
        raise ValueError(f"landmark {pair.name} lies on no curve")
    return pair.kind, pair.half


def _place_interior(
    brain: FlatBrain, points: Floats
) -> list[tuple[HalfName | None, Floats, Floats]]:
    """Return for each point its half (None: a cap), its surface point and its place in the plane."""
    if len(points) == 0:
        return []
    surface = brain.dissection.surface
    found = find_places(points, surface)
    placed: list[tuple[HalfName | None, Floats, Floats]] = []
    for face, point in zip(found.face, found.points, strict=True):
        piece = PIECES[brain.dissection.piece_of_face[face]]
        if piece not in ("anterior", "posterior"):
            placed.append((None, point, np.full(2, np.nan)))
            continue
        half = brain.halves[piece]  # type: ignore[index]
        place = flat_place(half, brain.dissection, int(face), point)
        placed.append((half.name, point, place))
    return placed


def flat_place(half: FlatHalf, dissection: Dissection, face: int, point: Floats) -> Floats:
    """Return the (2,) place in the rectangle of a point on a face of the whole surface."""
    corners = dissection.surface.vertices[dissection.surface.faces[face]]
    barycentric = igl.barycentric_coordinates(
        *(np.ascontiguousarray(row[None]) for row in (point, *corners))
    ).reshape(3)
    u, v = barycentric @ half.flat.corners[dissection.own_face[face]]
    return np.asarray(to_plane(np.array(u), half.law.beta(np.array(v))))
