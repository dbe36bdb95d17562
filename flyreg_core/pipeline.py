"""The method from end to end, each stage remembered; `Pipeline.run` reads as the paper does."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Generic, TypeVar

import numpy as np

from flyreg_core.alignment import Alignment, align
from flyreg_core.boundary import find_curves
from flyreg_core.brain_files import read_brain
from flyreg_core.caps import Cap, find_caps
from flyreg_core.correspondence import (
    FlatBrain,
    PlacedLandmark,
    boundary_pairs,
    place_landmarks,
    with_decisions,
)
from flyreg_core.cut import Dissection, dissect
from flyreg_core.cut_height import CutParameters
from flyreg_core.flatten import FlattenParameters
from flyreg_core.frame import BrainFrame
from flyreg_core.halves import FlatHalf, lay_flat, with_hole_as_seen
from flyreg_core.handles import HandleParameters
from flyreg_core.judgement import Judgement, judge
from flyreg_core.landmarks import (
    HALVES,
    HalfName,
    LandmarkPair,
    LandmarkParameters,
)
from flyreg_core.lay_over import lay_over
from flyreg_core.lift import Locators, Registration, build_locators, register
from flyreg_core.matching import CarriedCut, Match, match_to_target
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.pose import PoseParameters, find_frame
from flyreg_core.progress import Report, ignore, within
from flyreg_core.project import Brain, Project
from flyreg_core.shape_map import ShapeMap, fit_shape_map
from flyreg_core.simplify import Simplified, simplify
from flyreg_core.smooth import SmoothParameters, smooth
from flyreg_core.solid import VoxelSolid, close_solid, voxelize
from flyreg_core.suggestions import suggest_pairs
from flyreg_core.surface_distance import Distances, measure_distances
from flyreg_core.thin_plate_spline import ThinPlateSpline, fit_thin_plate_spline, kernel
from flyreg_core.torus import CLOSING, Torus, make_torus
from flyreg_core.trim import TrimParameters, TrimPlanes, within_solid

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class PreparedBrain:
    """One brain after all stages that concern it alone."""

    brain: Brain
    raw: SurfaceMesh  # as read, micrometres
    torus: Torus
    simplified: Simplified
    flat: FlatBrain
    caps: tuple[Cap, Cap]

    @property
    def surface(self) -> SurfaceMesh:
        """The main brain, closed, refined along its cuts."""
        return self.flat.dissection.surface

    @property
    def frame(self) -> BrainFrame:
        """The axes of the animal."""
        return self.flat.frame

    @property
    def halves(self) -> Mapping[HalfName, FlatHalf]:
        """Both halves laid flat."""
        return self.flat.halves


@dataclass(frozen=True, eq=False)
class Results:
    """What follows from a project."""

    project: Project
    source: PreparedBrain
    target: PreparedBrain
    alignment: Alignment  # of the source as read with the target as read
    to_target: ShapeMap | None  # of space, from the outsides alone; None: not asked for
    landmarks: tuple[PlacedLandmark, ...]
    registration: Registration
    distances: Distances | None  # registered to target and back; None: not measured
    judgement: Judgement | None  # None: not measured
    warnings: tuple[str, ...]
    seconds: Mapping[str, float]  # by stage, 0 where the last result was still good


class Memo(Generic[T]):
    """One stage of the pipeline with its last arguments and results.

    Arguments are compared with `==`: parameters by value, geometry by identity. A stage that is
    cancelled or fails leaves what was remembered untouched.
    """

    def __init__(self, name: str, stage: Callable[..., T], capacity: int = 1) -> None:
        self.name, self.seconds = name, 0.0
        self._stage, self._capacity = stage, capacity
        self._remembered: list[tuple[tuple[object, ...], T]] = []

    def __call__(self, *arguments: object, report: Report) -> T:
        """Return the stage's result for these arguments, computed or remembered."""
        for place, (known, result) in enumerate(self._remembered):
            if known == arguments:
                used = self._remembered.pop(place)
                self._remembered.insert(0, used)  # the last one to be forgotten
                return result
        started = perf_counter()
        result = self._stage(*arguments, report=report)
        self.seconds += perf_counter() - started
        self._remembered = [(arguments, result), *self._remembered][: self._capacity]
        return result


class Pipeline:
    """Runs projects; what did not change since the last run is not computed again."""

    def __init__(self) -> None:
        self._read = Memo("read", read_brain, capacity=4)
        self._frame = Memo("pose", _frame, capacity=4)
        self._align = Memo("alignment", _align, capacity=4)
        self._bend = Memo("shape map", _bend, capacity=4)
        self._match = Memo("matching", _match, capacity=6)
        self._solid = Memo("solid", voxelize, capacity=4)
        self._torus = Memo("torus", _torus, capacity=6)
        self._simplify = Memo("simplify", simplify, capacity=6)
        self._smooth = Memo("smooth", _smooth, capacity=6)
        self._cut = Memo("cut", _cut, capacity=6)
        self._flatten = Memo("flatten", _flatten, capacity=6)
        self._prepared = Memo("prepared", _prepared, capacity=6)
        self._lay_over = Memo("laying over", _lay_over, capacity=6)
        self._suggest = Memo("suggestions", _suggest, capacity=2)
        self._boundary = Memo("boundary landmarks", _boundary_pairs)
        self._place = Memo("landmarks", _place)
        self._locators = Memo("locators", lambda target, report: build_locators(target), capacity=2)
        self._basis = Memo("basis", _basis)
        self._spline = Memo("spline", _splines)
        self._lift = Memo("lift", register)
        self._distances = Memo("distances", measure_distances)
        self._judge = Memo("judgement", _judge)

    def prepare(
        self, brain: Brain, report: Report = ignore, match: Match | None = None
    ) -> PreparedBrain:
        """Return one brain read, solid, trimmed to a torus, cut, and laid flat.

        With a `match`, it lies and is trimmed as the target is, where the user said nothing.
        """
        raw, torus = self.make_torus(brain, within(report, 0.0, 0.5), match)
        simplified = self._simplify(torus.surface, brain.simplify, report=within(report, 0.5, 0.55))
        smoothed = self._smooth(simplified.surface, brain.smooth, report=within(report, 0.55, 0.7))
        dissection = self._cut(
            *(torus, simplified.surface, smoothed, brain.cut, None if match is None else match.cut),
            report=within(report, 0.7, 0.8),
        )
        flat = self._flatten(dissection, torus.frame, brain.flatten, report=within(report, 0.8, 1))
        return self._prepared(brain, raw, torus, simplified, flat, report=report)

    def make_torus(
        self, brain: Brain, report: Report = ignore, match: Match | None = None
    ) -> tuple[SurfaceMesh, Torus]:
        """Return one brain as read and as a torus, and nothing further."""
        raw, frame = self.raw(brain, within(report, 0.0, 0.3))
        frame = frame if match is None else match.frame
        solid = self._solid(raw, frame, brain.solid, report=within(report, 0.3, 0.6))
        torus = self._torus(
            *(raw, solid, brain.trim, brain.handles),
            *((None, None) if match is None else (match.planes, match.grid_runs_right)),
            report=within(report, 0.6, 1.0),
        )
        return raw, torus

    def raw(self, brain: Brain, report: Report = ignore) -> tuple[SurfaceMesh, BrainFrame]:
        """Return one brain as read, in micrometres, and how the animal lies in it."""
        raw = self._read(brain.input, report=within(report, 0.0, 0.7))
        return raw, self._frame(raw, brain.pose, report=within(report, 0.7, 1.0))

    def _prepare_pair(
        self, project: Project, report: Report
    ) -> tuple[PreparedBrain, PreparedBrain, Alignment, ShapeMap | None]:
        """Return source and target prepared, the source as the target is, and how it lies on it."""
        target = self.prepare(project.target, within(report, 0.0, 0.45))
        raw, frame = self.raw(project.source, within(report, 0.45, 0.5))
        alignment = self._align(
            *(raw, target.raw, frame, target.frame, project.source.pose.axes is not None),
            report=within(report, 0.5, 0.55),
        )
        to_target = None
        if project.boundary.is_by_shape:
            to_target = self._bend(raw, target.raw, alignment, report=within(report, 0.55, 0.65))
        match = self._match(
            *(frame, target.torus, target.flat.dissection, alignment, to_target),
            report=report,
        )
        source = target
        if project.source != project.target:
            source = self.prepare(project.source, within(report, 0.65, 0.95), match)
        if to_target is not None:
            source = self._lay_over(source, target, to_target, report=within(report, 0.95, 1.0))
        return source, target, alignment, to_target

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
        source, target, alignment, to_target = self._prepare_pair(
            project, within(report, 0.0, 0.84)
        )
        automatic = self._boundary(source.flat, target.flat, project.boundary, report=report)
        if to_target is not None:
            automatic += self._suggest(
                *(source.flat, target.flat, to_target, project.boundary.per_half), report=report
            )
        pairs = (*with_decisions(automatic, project.weights, project.moved), *project.pairs)
        places = tuple(replace(pair, weight=1.0) for pair in pairs if pair.is_placed)
        placed = self._place(source.flat, target.flat, places, report=report)
        weights = tuple(pair.weight for pair in pairs if pair.is_placed)
        locators = self._locators(target.flat, report=report)
        basis = self._basis(source.flat, placed, report=within(report, 0.84, 0.86))
        splines = self._spline(placed, weights, project.smoothing, report=report)
        landmarks = _weighted(placed, weights)
        registration = self._lift(
            *(source.flat, source.caps, target.flat, locators, splines, basis),
            placed,
            report=within(report, 0.86, 0.9),
        )
        distances = judgement = None
        if measure:
            judgement = self._judge(
                *(source.flat, target.flat, locators, placed, weights),
                *(registration, project.smoothing),
                report=within(report, 0.9, 0.91),
            )
            distances = self._distances(
                registration.surface, target.surface, report=within(report, 0.9, 1.0)
            )
        seconds = {memo.name: memo.seconds for memo in memos}
        warnings = find_warnings(source, target, alignment, pairs, landmarks, registration)
        return Results(
            *(project, source, target, alignment, to_target, landmarks),
            *(registration, distances, judgement, warnings, seconds),
        )


@dataclass(frozen=True, eq=False)
class _Smoothed:
    vertices: Floats


def _smooth(surface: SurfaceMesh, parameters: SmoothParameters, report: Report) -> _Smoothed:
    return _Smoothed(smooth(surface.vertices, surface.faces, parameters, report))


def _cut(
    torus: Torus,
    surface: SurfaceMesh,
    smoothed: _Smoothed,
    parameters: CutParameters,
    cut: CarriedCut | None,
    report: Report,
) -> Dissection:
    report(0.0, "cutting the brain into halves")
    carried = None if cut is None else cut.height_over_cut(surface)
    return dissect(torus, surface, smoothed.vertices, parameters, carried)


def _frame(raw: SurfaceMesh, parameters: PoseParameters, report: Report) -> BrainFrame:
    report(0.0, "finding how the brain lies")
    return find_frame(raw, parameters)


def _torus(
    raw: SurfaceMesh,
    solid: VoxelSolid,
    trimming: TrimParameters,
    handles: HandleParameters,
    planes: TrimPlanes | None,
    grid_runs_right: bool | None,
    report: Report,
) -> Torus:
    if planes is not None:
        closed = close_solid(solid, CLOSING[0])
        trimming = trimming.completed_by(within_solid(planes, closed))
    return make_torus(raw, solid, trimming, handles, report, grid_runs_right)


def _align(
    source: SurfaceMesh,
    target: SurfaceMesh,
    own: BrainFrame,
    target_frame: BrainFrame,
    is_stated: bool,
    report: Report,
) -> Alignment:
    return align(source, target, own, target_frame, report, is_stated)


def _match(
    own: BrainFrame,
    target: Torus,
    dissection: Dissection,
    alignment: Alignment,
    to_target: ShapeMap | None,
    report: Report,
) -> Match:
    return match_to_target(own, target, dissection, alignment, to_target)


def _bend(
    source: SurfaceMesh, target: SurfaceMesh, alignment: Alignment, report: Report
) -> ShapeMap:
    return fit_shape_map(source, target, alignment.to_target, report)


def _flatten(
    dissection: Dissection, frame: BrainFrame, parameters: FlattenParameters, report: Report
) -> FlatBrain:
    curves = find_curves(dissection, frame)
    halves = {
        half: lay_flat(
            dissection, curves, half, parameters, within(report, number / 2, (number + 1) / 2)
        )
        for number, half in enumerate(HALVES)
    }
    if parameters.passes is None:
        halves, curves = with_hole_as_seen(halves, curves, dissection.surface, frame)
    return FlatBrain(dissection, frame, curves, halves)


def _prepared(
    brain: Brain,
    raw: SurfaceMesh,
    torus: Torus,
    simplified: Simplified,
    flat: FlatBrain,
    report: Report,
) -> PreparedBrain:
    report(1.0, "prepared")
    return PreparedBrain(
        brain, raw, torus, simplified, flat, find_caps(flat.dissection, flat.curves)
    )


def _lay_over(
    source: PreparedBrain, target: PreparedBrain, to_target: ShapeMap, report: Report
) -> PreparedBrain:
    return replace(source, flat=lay_over(source.flat, target.flat, to_target, report))


def _suggest(
    source: FlatBrain,
    target: FlatBrain,
    to_target: ShapeMap,
    per_half: int,
    report: Report,
) -> tuple[LandmarkPair, ...]:
    report(0.0, "suggesting landmarks")
    return suggest_pairs(source, target, to_target, per_half)


def _boundary_pairs(
    source: FlatBrain, target: FlatBrain, parameters: LandmarkParameters, report: Report
) -> tuple[LandmarkPair, ...]:
    return boundary_pairs(source, target, parameters)


def _place(
    source: FlatBrain, target: FlatBrain, pairs: tuple[LandmarkPair, ...], report: Report
) -> tuple[PlacedLandmark, ...]:
    return place_landmarks(source, target, pairs)


def _weighted(
    placed: tuple[PlacedLandmark, ...], weights: tuple[float, ...]
) -> tuple[PlacedLandmark, ...]:
    return tuple(
        replace(mark, pair=replace(mark.pair, weight=weight))
        for mark, weight in zip(placed, weights, strict=True)
    )


def _basis(
    source: FlatBrain, placed: tuple[PlacedLandmark, ...], report: Report
) -> Mapping[HalfName, Floats]:
    report(0.0, "preparing the spline")
    return {half: kernel(source.halves[half].plane, _ends(placed, half, 0)) for half in HALVES}


def _splines(
    placed: tuple[PlacedLandmark, ...], weights: tuple[float, ...], smoothing: float, report: Report
) -> Mapping[HalfName, ThinPlateSpline]:
    report(0.0, "fitting the spline")
    splines = {}
    for half in HALVES:
        acting = [w for mark, w in zip(placed, weights, strict=True) if half in mark.plane]
        splines[half] = fit_thin_plate_spline(
            _ends(placed, half, 0), _ends(placed, half, 1), np.array(acting), smoothing
        )
    return splines


def _judge(
    source: FlatBrain,
    target: FlatBrain,
    locators: Locators,
    placed: tuple[PlacedLandmark, ...],
    weights: tuple[float, ...],
    registration: Registration,
    smoothing: float,
    report: Report,
) -> Judgement:
    report(0.0, "judging the landmarks")
    landmarks = _weighted(placed, weights)
    return judge(source, target, locators, landmarks, registration, smoothing)


def _ends(placed: tuple[PlacedLandmark, ...], half: HalfName, end: int) -> Floats:
    """Return the (k, 2) source (0) or target (1) places of the landmarks that act in a half."""
    return np.array([mark.plane[half][end] for mark in placed if half in mark.plane])


def find_warnings(
    source: PreparedBrain,
    target: PreparedBrain,
    alignment: Alignment,
    pairs: tuple[LandmarkPair, ...],
    landmarks: tuple[PlacedLandmark, ...],
    registration: Registration,
) -> tuple[str, ...]:
    """Return what the user should know about a registration that went through, a sentence each."""
    warnings = []
    name = source.brain.input.name
    if alignment.is_mirrored and source.brain.pose.axes is None:
        warnings.append(
            f"{name} is taken for the mirror image of a brain, as {target.brain.input.name} fits it "
            "better so; state how it lies if this is wrong"
        )
    if not alignment.is_sure and source.brain.pose.axes is None:
        warnings.append(
            f"which side of {name} is its front and which its top is not sure; look whether it lies "
            f"as {target.brain.input.name} does, and state how it lies if not"
        )
    for brain in (source, target):
        name = brain.brain.input.name
        warnings += [
            f"{name}: {text}" for text in (*brain.torus.warnings, *brain.simplified.warnings)
        ]
    warnings += [
        f"landmark {pair.name} has only one end and is not used"
        for pair in pairs
        if not pair.is_placed
    ]
    warnings += [
        f"landmark {mark.pair.name} lies on different halves, or beyond a trim plane, and is not used"
        for mark in landmarks
        if not mark.plane
    ]
    for half in HALVES:
        warped = registration.halves[half]
        if warped.flipped:
            warnings.append(f"{warped.flipped} triangles of the {half} half are folded")
    return tuple(warnings)
