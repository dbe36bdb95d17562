"""What the user decided, and nothing that follows from it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from flyreg_core.cut_height import CutParameters
from flyreg_core.errors import InputError, LandmarkError
from flyreg_core.flatten import FlattenParameters
from flyreg_core.handles import HandleParameters
from flyreg_core.landmarks import CORNERS, LandmarkPair, LandmarkParameters
from flyreg_core.pose import PoseParameters
from flyreg_core.simplify import SimplifyParameters
from flyreg_core.smooth import SmoothParameters
from flyreg_core.solid import SolidParameters
from flyreg_core.trim import TrimParameters

Role = Literal["source", "target"]
Unit = Literal["nm", "um", "mm"]
InputKind = Literal["surface", "point cloud", "label volume"]


@dataclass(frozen=True)
class BrainInput:
    """A file or template with a brain, exactly as it was when it was chosen."""

    name: str  # as given: a path or a template's label
    path: str  # the file, absolute
    sha256: str
    unit: Unit
    unit_known_by: (
        str  # "stated by the user", "template metadata", "file header", "judged from the size"
    )
    kind: InputKind = "surface"
    voxel_size_um: tuple[float, float, float] | None = None  # of a volume, as the user states it

    def __post_init__(self) -> None:
        size = self.voxel_size_um
        if size is not None and not all(math.isfinite(edge) and edge > 0 for edge in size):
            raise InputError(
                f"the voxel size must be three positive numbers of micrometres, not {size}"
            )


@dataclass(frozen=True)
class Brain:
    """One brain and how it is prepared."""

    input: BrainInput
    pose: PoseParameters = PoseParameters()
    solid: SolidParameters = SolidParameters()
    trim: TrimParameters = TrimParameters()
    handles: HandleParameters = HandleParameters()
    simplify: SimplifyParameters = SimplifyParameters()
    smooth: SmoothParameters = SmoothParameters()
    cut: CutParameters = CutParameters()
    flatten: FlattenParameters = FlattenParameters()


@dataclass(frozen=True)
class NeuropilFile:
    """A file with surfaces of neuropils, and the brain in whose coordinates they are."""

    input: BrainInput
    role: Role


@dataclass(frozen=True)
class Snapshot:
    """Weights and smoothing as they once were, to go back to or to compare with."""

    weights: Mapping[str, float]  # of boundary pairs, by id; default 1
    pair_weights: Mapping[str, float]  # of the user's own pairs, by id
    smoothing: float
    muted: tuple[str, ...] = ()
    solo: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _check_strengths({**self.weights, **self.pair_weights}, self.smoothing)


@dataclass(frozen=True)
class Project:
    """Everything that decides a registration. Compared by value; undo is the previous project."""

    source: Brain
    target: Brain
    boundary: LandmarkParameters = LandmarkParameters()
    pairs: tuple[LandmarkPair, ...] = ()  # the user's own
    weights: Mapping[str, float] = field(
        default_factory=dict
    )  # of boundary pairs, by id; default 1
    moved: Mapping[str, float] = field(
        default_factory=dict
    )  # target shares of boundary pairs, by id
    muted: tuple[str, ...] = ()  # ids of pairs that keep their weight but do not pull
    solo: tuple[str, ...] = ()  # ids of the only pairs that pull, besides the corners; () for all
    smoothing: float = 1e-2  # lambda of the spline
    neuropils: tuple[NeuropilFile, ...] = ()  # regions near which landmarks are weighted together
    view: Mapping[str, object] = field(default_factory=dict)  # what the window restores
    snapshots: Mapping[str, Snapshot] = field(default_factory=dict)  # by name: "A", "B"

    def __post_init__(self) -> None:
        _check_strengths(self.weights, self.smoothing)

    def is_muted(self, identifier: str) -> bool:
        """Tell whether a pair keeps its weight but does not pull: muted, or others play solo."""
        if self.solo:
            return identifier not in self.solo and identifier not in CORNERS
        return identifier in self.muted


def _check_strengths(weights: Mapping[str, float], smoothing: float) -> None:
    if not (math.isfinite(smoothing) and smoothing >= 0):
        raise LandmarkError(f"the smoothing must be 0 or a positive number, not {smoothing}")
    for identifier, weight in weights.items():
        if not (math.isfinite(weight) and weight >= 0):
            raise LandmarkError(
                f"the weight of landmark {identifier} must be 0 or a positive number, not {weight}"
            )
