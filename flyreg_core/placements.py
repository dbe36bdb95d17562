"""Where all landmarks of a project lie, kept while few of them change."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

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

    def weights(self, half: HalfName) -> Floats:
        """Return how much the landmarks that act in a half weigh."""
        rows = self.geometry.acting[half].tolist()
        return np.array([self.landmarks[row].weight for row in rows])


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
    known: dict[str, PlacedLandmark] = {}
    if last is not None and last.source is source and last.target is target:
        known = {mark.pair.id: mark for mark in last.landmarks}
    complete = [pair for pair in pairs if pair.is_placed]
    new = tuple(pair for pair in complete if not _is_there(known.get(pair.id), pair))
    known |= {mark.pair.id: mark for mark in place_landmarks(source, target, new)}
    landmarks = tuple(_renewed(known[pair.id], pair, pair.id in muted) for pair in complete)
    is_as_before = (
        last is not None
        and not new
        and len(landmarks) == len(last.landmarks)
        and all(
            mark.plane is other.plane and mark.pair.id == other.pair.id
            for mark, other in zip(landmarks, last.landmarks, strict=True)
        )
    )
    geometry = last.geometry if last is not None and is_as_before else _geometry(landmarks)
    return Placements(source, target, landmarks, geometry)


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


def _geometry(landmarks: tuple[PlacedLandmark, ...]) -> Geometry:
    acting, sources, targets = {}, {}, {}
    for half in HALVES:
        rows = [row for row, mark in enumerate(landmarks) if half in mark.plane]
        ends = np.array([landmarks[row].plane[half] for row in rows]).reshape(-1, 2, 2)
        acting[half], sources[half], targets[half] = np.array(rows, int), ends[:, 0], ends[:, 1]
    return Geometry(find_ends(landmarks), acting, sources, targets)
