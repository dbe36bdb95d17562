"""The method from end to end, each stage remembered: brains are prepared, paired, bent and lifted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flyreg_core.cache import Cache
from flyreg_core.correspondence import FlatBrain, PlacedLandmark, boundary_pairs, with_decisions
from flyreg_core.judgement import Judgement, judge
from flyreg_core.landmarks import HALVES, HalfName, LandmarkPair, LandmarkParameters
from flyreg_core.lift import Locators, Registration, build_locators, register
from flyreg_core.live_spline import LiveSpline
from flyreg_core.memo import Memo
from flyreg_core.mesh import Floats
from flyreg_core.one_thread import on_one_thread
from flyreg_core.placements import Geometry, Placements, place_all
from flyreg_core.preparation import Preparation
from flyreg_core.progress import Report, ignore, in_chunks, within
from flyreg_core.project import Project
from flyreg_core.results import Pair, PreparedBrain, Results, find_warnings
from flyreg_core.side_by_side import both, both_halves
from flyreg_core.suggestions import suggest_pairs, turned_round
from flyreg_core.surface_distance import measure_distances
from flyreg_core.thin_plate_spline import fit_thin_plate_spline


class Pipeline(Preparation):
    """Runs projects: what did not change since the last run is not computed again.

    With a `cache`, nor are pairs of brains that any program has prepared before.
    """

    def __init__(self, cache: Cache | None = None) -> None:
        super().__init__(cache)
        self._suggest = Memo("suggestions", _suggest, capacity=2)
        self._boundary = Memo("boundary landmarks", _boundary_pairs)
        self._place = Memo("landmarks", self._placed)
        self._locators = Memo("locators", lambda target, report: build_locators(target), capacity=2)
        self._live = Memo("live splines", _live_splines)
        self._spline = Memo("spline", _bend)
        self._lift = Memo("lift", self._register)
        self._distances = Memo("distances", measure_distances)
        self._judge = Memo("judgement", _judge)
        self._placements: Placements | None = None
        self._near: tuple[PreparedBrain, FlatBrain, Registration] | None = None

    @on_one_thread
    def run(self, project: Project, report: Report = ignore, measure: bool = True) -> Results:
        """Return what follows from a project; without `measure` distances are left out.

        Raises
        ------
        FlyregError
            What a stage cannot do, in a sentence.
        Cancelled
            `report` said so; what finished before stays remembered.
        """
        memos = [value for value in vars(self).values() if isinstance(value, Memo)]
        for memo in memos:
            memo.seconds = 0.0
        pair = self.prepare_pair(project, within(report, 0.0, 0.84))
        source, target, to_target = pair.source, pair.target, pair.to_target
        late = within(report, 0.84, 0.86)  # none of these takes long
        automatic = self._boundary(source.flat, target.flat, project.boundary, report=late)
        if to_target is not None:
            automatic += self._suggest(pair, project.boundary.per_half, report=late)
        pairs = (*with_decisions(automatic, project.weights, project.moved), *project.pairs)
        muted = tuple(pair.id for pair in pairs if project.is_muted(pair.id))
        placements = self._place(source.flat, target.flat, pairs, muted, report=late)
        locators = self._locators(target.flat, report=late)
        places = self._bend_flat(placements, project.smoothing, measure, late)
        registration = self._lift(
            *(source, target.flat, locators, places, placements.geometry),
            report=within(report, 0.86, 0.9),
        )
        landmarks = placements.landmarks
        distances = judgement = None
        if measure:
            judgement, distances = both(
                lambda: self._judge(
                    *(source.flat, target.flat, locators),
                    *(landmarks, registration, project.smoothing),
                    report=within(report, 0.9, 0.91),
                ),
                lambda: self._distances(
                    registration.surface, target.surface, report=within(report, 0.91, 1.0)
                ),
            )
        seconds = {memo.name: memo.seconds for memo in memos if memo.name}
        warnings = find_warnings(source, target, pair.alignment, pairs, landmarks, registration)
        return Results(
            *(project, source, target, pair.alignment, to_target, landmarks),
            *(registration, distances, judgement, warnings, seconds),
        )

    def _placed(
        self,
        source: FlatBrain,
        target: FlatBrain,
        pairs: tuple[LandmarkPair, ...],
        muted: tuple[str, ...],
        report: Report,
    ) -> Placements:
        last = self._placements
        self._placements = place_all(source, target, pairs, last, report, frozenset(muted))
        return self._placements

    def _bend_flat(
        self, placements: Placements, smoothing: float, is_exact: bool, report: Report
    ) -> _FlatPlaces:
        """Return where vertices go, found anew where it must be exact, which outlasts the hand."""
        live = self._live(placements.source, report=report)
        weights = tuple(tuple(placements.weights[half].tolist()) for half in HALVES)
        asked = (placements.source, live, placements.geometry, weights, smoothing)
        is_exact = is_exact or self._spline.knows(*asked, True)
        return self._spline(*asked, is_exact, report=report)

    def _register(
        self,
        source: PreparedBrain,
        target: FlatBrain,
        locators: Locators,
        places: _FlatPlaces,
        geometry: Geometry,
        report: Report,
    ) -> Registration:
        """Return the registration; while the hand moves, vertices are looked for where they were."""
        last = None
        if self._near is not None and not places.is_exact and self._near[:2] == (source, target):
            last = self._near[2]
        registration = register(
            *(source.flat, source.caps, target, locators, places.halves, geometry.ends),
            *(report, last),
        )
        self._near = (source, target, registration)
        return registration


@dataclass(frozen=True, eq=False)
class _FlatPlaces:
    """Where the vertices of each half go in the rectangle."""

    halves: Mapping[HalfName, Floats]
    is_exact: bool  # found anew, not from what was kept


def _suggest(pair: Pair, per_half: int, report: Report) -> tuple[LandmarkPair, ...]:
    report(0.0, "suggesting landmarks")
    led = pair.turned_round() if pair.is_led_by_source else pair
    if led.to_target is None:
        return ()
    suggested = suggest_pairs(led.source.flat, led.target.flat, led.to_target, per_half)
    return turned_round(suggested) if pair.is_led_by_source else suggested


def _boundary_pairs(
    source: FlatBrain, target: FlatBrain, parameters: LandmarkParameters, report: Report
) -> tuple[LandmarkPair, ...]:
    return boundary_pairs(source, target, parameters)


def _live_splines(source: FlatBrain, report: Report) -> Mapping[HalfName, LiveSpline]:
    report(0.0, "preparing the spline")
    return {half: LiveSpline(source.halves[half].plane) for half in HALVES}


def _bend(
    source: FlatBrain,
    live: Mapping[HalfName, LiveSpline],
    geometry: Geometry,
    weights: tuple[tuple[float, ...], ...],
    smoothing: float,
    is_exact: bool,
    report: Report,
) -> _FlatPlaces:
    """Return where the vertices of each half go in the rectangle."""
    report(0.0, "fitting the spline")
    weights_of = dict(zip(HALVES, weights, strict=True))

    def bend(half: HalfName, report: Report) -> Floats:
        own = np.array(weights_of[half])
        asked = (geometry.sources[half], geometry.targets[half], own, smoothing)
        if not is_exact:
            return live[half](*asked, report)
        spline = fit_thin_plate_spline(*asked)
        return in_chunks(spline, source.halves[half].plane, report, "bending the source")

    return _FlatPlaces(both_halves(bend, report), is_exact)


def _judge(
    source: FlatBrain,
    target: FlatBrain,
    locators: Locators,
    landmarks: tuple[PlacedLandmark, ...],
    registration: Registration,
    smoothing: float,
    report: Report,
) -> Judgement:
    report(0.0, "judging the landmarks")
    return judge(source, target, locators, landmarks, registration, smoothing)
