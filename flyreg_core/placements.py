"""Where all landmarks of a project lie, kept while few of them change."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flyreg_core.correspondence import FlatBrain, PlacedLandmark, place_landmarks
from flyreg_core.landmarks import HALVES, HalfName, LandmarkPair
from flyreg_core.lift import LandmarkEnds, find_ends
from flyreg_core.mesh import Floats, Integers
from flyreg_core.progress import Report


@dataclass(frozen=True, eq=False)
class Geometry:
    """The places of landmarks as arrays, whatever they weigh."""

    ends: LandmarkEnds
    acting: Mapping[HalfName, Integers]  # rows of the landmarks that act in a half
    sources: Mapping[HalfName, Floats]  # (k, 2) of these, in the rectangle
    targets: Mapping[HalfName, Floats]


@dataclass(frozen=True, eq=False)
class Placements:
    """Landmarks of a pair of brains, each with its places."""

    source: FlatBrain
    target: FlatBrain
    landmarks: tuple[PlacedLandmark, ...]
    geometry: Geometry

    @cached_property
    def by_id(self) -> Mapping[str, PlacedLandmark]:
        """The landmarks by the ids of their pairs, in order."""
        return {mark.pair.id: mark for mark in self.landmarks}

    @cached_property
    def weights(self) -> Mapping[HalfName, Floats]:
        """How much the landmarks that act in each half weigh."""
        own = np.array([mark.weight for mark in self.landmarks], dtype=float)
        return {half: own[rows] for half, rows in self.geometry.acting.items()}


def place_all(
    source: FlatBrain,
    target: FlatBrain,
    pairs: tuple[LandmarkPair, ...],
    last: Placements | None,
    report: Report,
    muted: Collection[str] = (),
) -> Placements:
    """Return where the complete pairs lie; those that `last` knows are not looked for again.

    Those whose ids are among `muted` keep their weights but do not pull.
    """
    report(0.0, "placing landmarks")
    if last is not None and (last.source is not source or last.target is not target):
        last = None
    known = {} if last is None else last.by_id
    complete = [pair for pair in pairs if pair.is_placed]
    lacking = tuple(pair for pair in complete if not _is_there(known.get(pair.id), pair))
    new = {mark.pair.id: mark for mark in place_landmarks(source, target, lacking)}
    landmarks = tuple(
        _renewed(new.get(pair.id) or known[pair.id], pair, pair.id in muted) for pair in complete
    )
    geometry = None
    if last is not None and list(known) == [pair.id for pair in complete]:
        moved = [row for row, pair in enumerate(complete) if pair.id in new]
        geometry = _with_moved(last, landmarks, moved)
    return Placements(source, target, landmarks, geometry or _geometry(landmarks))


def _is_there(mark: PlacedLandmark | None, pair: LandmarkPair) -> bool:
    """Tell whether a landmark lies where a pair says."""
    if mark is None or mark.pair is pair:
        return mark is not None
    old = mark.pair
    return (old.kind, old.half, old.source, old.target) == (
        *(pair.kind, pair.half, pair.source, pair.target),
    )


def _renewed(mark: PlacedLandmark, pair: LandmarkPair, is_muted: bool) -> PlacedLandmark:
    if mark.pair is pair and mark.is_muted == is_muted:
        return mark
    return replace(mark, pair=pair, is_muted=is_muted)


def _with_moved(
    last: Placements, landmarks: tuple[PlacedLandmark, ...], moved: list[int]
) -> Geometry | None:
    """Return the geometry after some rows moved; None if one acts in other halves than before."""
    old = last.geometry
    if not moved:
        return old
    if any(last.landmarks[row].plane.keys() != landmarks[row].plane.keys() for row in moved):
        return None
    sources, targets = (
        {half: at.copy() for half, at in own.items()} for own in (old.sources, old.targets)
    )
    for row in moved:
        for half, (start, end) in landmarks[row].plane.items():
            place = np.searchsorted(old.acting[half], row)
            sources[half][place], targets[half][place] = start, end
    return Geometry(find_ends(landmarks), old.acting, sources, targets)


def _geometry(landmarks: tuple[PlacedLandmark, ...]) -> Geometry:
    acting, sources, targets = {}, {}, {}
    for half in HALVES:
        rows = [row for row, mark in enumerate(landmarks) if half in mark.plane]
        ends = np.array([landmarks[row].plane[half] for row in rows]).reshape(-1, 2, 2)
        acting[half], sources[half], targets[half] = np.array(rows, int), ends[:, 0], ends[:, 1]
    return Geometry(find_ends(landmarks), acting, sources, targets)
