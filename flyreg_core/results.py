"""What follows from a project, and what the user should know about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flyreg_core.alignment import Alignment
from flyreg_core.caps import Cap
from flyreg_core.correspondence import FlatBrain, PlacedLandmark
from flyreg_core.frame import BrainFrame
from flyreg_core.halves import FlatHalf
from flyreg_core.judgement import Judgement
from flyreg_core.landmarks import HALVES, HalfName, LandmarkPair
from flyreg_core.lift import Registration
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.project import Brain, Project
from flyreg_core.relief import relief_of
from flyreg_core.shape_map import ShapeMap
from flyreg_core.simplify import Simplified
from flyreg_core.surface_distance import Distances
from flyreg_core.torus import Torus

MOST_NAMED = 5
"""So many landmarks are named in one warning."""


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

    @cached_property
    def relief(self) -> Floats:
        """(n,) how bright each vertex of the surface is drawn, see `relief_of`."""
        return relief_of(self.surface)


@dataclass(frozen=True, eq=False)
class Pair:
    """Two brains prepared for each other, and how the source lies on the target."""

    source: PreparedBrain  # trimmed, cut and laid flat as the target is, unless it leads
    target: PreparedBrain
    alignment: Alignment  # of the source as read with the target as read
    to_target: ShapeMap | None  # of space, from the outsides alone; None: not asked for
    is_led_by_source: bool = False  # the target is trimmed, cut and laid flat as the source is

    def turned_round(self) -> Pair:
        """Return the same brains, each in the role of the other."""
        return Pair(
            self.target,
            self.source,
            self.alignment.turned_round(self.target.frame),
            None if self.to_target is None else self.to_target.turned_round(),
            not self.is_led_by_source,
        )


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

    @cached_property
    def acting(self) -> int:
        """How many landmarks pull."""
        return sum(landmark.weight > 0 for landmark in self.landmarks)

    @cached_property
    def beyond_alignment_um(self) -> Floats:
        """(n,) how far registration took vertices from where the affine alignment had put them."""
        aligned = self.alignment.to_target(self.source.surface.vertices)
        return np.asarray(np.linalg.norm(self.registration.surface.vertices - aligned, axis=1))


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
        wanted, made = brain.brain.cut.shift_um, brain.flat.dissection.shift_um
        if made != wanted:
            warnings.append(
                f"{name}: the cut was moved by {made:.1f} um instead of {wanted:.1f}, so that it passes "
                "both trim openings"
            )
        warnings += [
            f"{name}: {text}" for text in (*brain.torus.warnings, *brain.simplified.warnings)
        ]
    if lacking := [pair.name for pair in pairs if not pair.is_placed]:
        warnings.append(_lacking(lacking))
    if astray := [mark.pair.name for mark in landmarks if not mark.plane]:
        warnings.append(_astray(astray))
    for half in HALVES:
        warped = registration.halves[half]
        if warped.flipped:
            warnings.append(f"{warped.flipped} triangles of the {half} half are folded")
    return tuple(warnings)


def _lacking(names: list[str]) -> str:
    """Say which landmarks are still to be placed."""
    if len(names) == 1:
        return f"“{names[0]}” is not placed on both brains and is not used"
    return (
        f"{len(names)} landmarks are not placed on both brains and are not used: {_listed(names)}"
    )


def _astray(names: list[str]) -> str:
    """Say which landmarks have no place that both brains share."""
    where = "different halves, or beyond a trim plane,"
    if len(names) == 1:
        return f"landmark {names[0]} lies on {where} and is not used"
    return f"{len(names)} landmarks lie on {where} and are not used: {_listed(names)}"


def _listed(names: list[str]) -> str:
    return ", ".join(names[:MOST_NAMED]) + (" and others" if len(names) > MOST_NAMED else "")
