"""Brains made ready to be registered, alone and in pairs; each stage remembered, pairs kept on disk."""

from __future__ import annotations

from dataclasses import dataclass, replace

from flyreg_core.alignment import Alignment, align
from flyreg_core.boundary import find_curves
from flyreg_core.brain_files import check_unchanged, read_brain
from flyreg_core.cache import Cache, key_of
from flyreg_core.caps import find_caps
from flyreg_core.correspondence import FlatBrain
from flyreg_core.cut import Dissection, dissect
from flyreg_core.cut_height import CutParameters
from flyreg_core.flatten import FlattenParameters
from flyreg_core.frame import BrainFrame
from flyreg_core.halves import lay_flat, with_hole_as_seen
from flyreg_core.handles import HandleParameters
from flyreg_core.lay_over import lay_over
from flyreg_core.match_detail import match_detail
from flyreg_core.matching import CarriedCut, Match, match_to_target, share_of_pockets, who_decides
from flyreg_core.memo import Memo
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.one_thread import on_one_thread
from flyreg_core.pose import PoseParameters, find_frame
from flyreg_core.progress import Report, ignore, within
from flyreg_core.project import Brain, Project
from flyreg_core.results import Pair, PreparedBrain
from flyreg_core.shape_map import ShapeMap, fit_shape_map
from flyreg_core.side_by_side import both, both_halves
from flyreg_core.simplify import Simplified, simplify
from flyreg_core.smooth import SmoothParameters, smooth
from flyreg_core.solid import VoxelSolid, close_solid, voxelize
from flyreg_core.torus import CLOSING, Torus, make_torus
from flyreg_core.trim import TrimParameters, TrimPlanes, within_solid


class Preparation:
    """Prepares brains, alone and in pairs; what did not change is not computed again.

    With a `cache`, nor are pairs that any program has prepared before.
    """

    def __init__(self, cache: Cache | None = None) -> None:
        self._cache = cache
        self._pair = Memo("", self._cached_pair, capacity=4)  # its stages count
        self._read = Memo("read", read_brain, capacity=4)
        self._frame = Memo("pose", _frame, capacity=4)
        self._align = Memo("alignment", _align, capacity=4)
        self._shape = Memo("shape map", _fit_shape, capacity=4)
        self._match = Memo("matching", _match, capacity=6)
        self._solid = Memo("solid", voxelize, capacity=4)
        self._torus = Memo("torus", _torus, capacity=6)
        self._simplify = Memo("simplify", simplify, capacity=6)
        self._smooth = Memo("smooth", _smooth, capacity=6)
        self._cut = Memo("cut", _cut, capacity=6)
        self._flatten = Memo("flatten", _flatten, capacity=6)
        self._prepared = Memo("prepared", _prepared, capacity=6)
        self._lay_over = Memo("laying over", _lay_over, capacity=6)
        self._match_detail = Memo("matching detail", _match_detail, capacity=6)

    @on_one_thread
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

    @on_one_thread
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

    def is_prepared(self, project: Project) -> bool:
        """Tell whether the brains of a project were prepared before, and are known or in the cache."""
        asked = (project.source, project.target, project.boundary.is_by_shape)
        if self._pair.knows(*asked):
            return True
        return self._cache is not None and self._cache.has(key_of("pair", *asked))

    def prepare_pair(self, project: Project, report: Report) -> Pair:
        """Return source and target prepared, from memory or disk if they were prepared before."""
        return self._pair(
            *(project.source, project.target, project.boundary.is_by_shape), report=report
        )

    def _cached_pair(self, source: Brain, target: Brain, is_by_shape: bool, report: Report) -> Pair:
        if self._cache is None:
            return self._led_pair(source, target, is_by_shape, report)
        for brain in (source, target):
            report(0.0, "reading the brain")
            check_unchanged(brain.input)
        key = key_of("pair", source, target, is_by_shape)
        report(0.1, "opening prepared brains")
        known = self._cache.get(key)
        if isinstance(known, Pair):
            return replace(
                known,
                source=replace(known.source, brain=source),
                target=replace(known.target, brain=target),
            )
        pair = self._led_pair(source, target, is_by_shape, report)
        self._cache.put(key, pair)
        return pair

    def _led_pair(self, source: Brain, target: Brain, is_by_shape: bool, report: Report) -> Pair:
        """Return both brains prepared, the one that leads before the other."""
        if is_by_shape and source != target and self._is_led_by_source(source, target, report):
            return self._make_pair(target, source, is_by_shape, report).turned_round()
        return self._make_pair(source, target, is_by_shape, report)

    def _is_led_by_source(self, source: Brain, target: Brain, report: Report) -> bool:
        leader = who_decides(source, target)
        if leader is None:
            shares = []
            for brain in (target, source):
                raw, frame = self.raw(brain, within(report, 0.0, 0.1))
                solid = self._solid(raw, frame, brain.solid, report=within(report, 0.1, 0.2))
                shares.append(share_of_pockets(solid))
            leader = "source" if shares[1] < shares[0] else "target"
        return leader == "source"

    def _make_pair(
        self, source_brain: Brain, target_brain: Brain, is_by_shape: bool, report: Report
    ) -> Pair:
        """Return source and target prepared, the source as the target is, and how it lies on it."""
        target = self.prepare(target_brain, within(report, 0.0, 0.45))
        raw, frame = self.raw(source_brain, within(report, 0.45, 0.5))
        alignment = self._align(
            *(raw, target.raw, frame, target.frame, source_brain.pose.axes is not None),
            report=within(report, 0.5, 0.55),
        )
        to_target = None
        if is_by_shape:
            to_target = self._shape(raw, target.raw, alignment, report=within(report, 0.55, 0.65))
        match = self._match(
            *(frame, target.torus, target.flat.dissection, alignment, to_target),
            report=report,
        )
        source = target
        if source_brain != target_brain:
            source = self.prepare(source_brain, within(report, 0.65, 0.95), match)
        if to_target is not None:
            source = self._lay_over(source, target, to_target, report=within(report, 0.95, 0.98))
            source, target = self._match_detail(source, target, report=within(report, 0.98, 1.0))
        return Pair(source, target, alignment, to_target)


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


def _fit_shape(
    source: SurfaceMesh, target: SurfaceMesh, alignment: Alignment, report: Report
) -> ShapeMap:
    return fit_shape_map(source, target, alignment.to_target, report)


def _flatten(
    dissection: Dissection, frame: BrainFrame, parameters: FlattenParameters, report: Report
) -> FlatBrain:
    curves = find_curves(dissection, frame)
    halves = both_halves(
        lambda half, report: lay_flat(dissection, curves, half, parameters, report), report
    )
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
        brain, raw, torus, simplified, flat, find_caps(flat.dissection, flat.curves, flat.added)
    )


def _lay_over(
    source: PreparedBrain, target: PreparedBrain, to_target: ShapeMap, report: Report
) -> PreparedBrain:
    return replace(source, flat=lay_over(source.flat, target.flat, to_target, report))


def _match_detail(
    source: PreparedBrain, target: PreparedBrain, report: Report
) -> tuple[PreparedBrain, PreparedBrain]:
    """Return both brains with faces divided where the other one is more detailed."""
    return both(
        lambda: _matched_in_detail(source, target.flat, report),
        lambda: _matched_in_detail(target, source.flat, ignore),
    )


def _matched_in_detail(brain: PreparedBrain, other: FlatBrain, report: Report) -> PreparedBrain:
    """Return a brain with faces divided, until it has as many vertices as the user has said."""
    flat = match_detail(brain.flat, other, report, brain.brain.simplify.vertices)
    if flat is brain.flat:
        return brain
    return replace(brain, flat=flat, caps=find_caps(flat.dissection, flat.curves, flat.added))
