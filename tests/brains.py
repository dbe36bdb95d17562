"""Brains taken through the stages one by one, without what the engine remembers between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flyreg_core import progress
from flyreg_core.boundary import find_curves
from flyreg_core.caps import find_caps
from flyreg_core.correspondence import (
    FlatBrain,
    PlacedLandmark,
    boundary_pairs,
    place_landmarks,
)
from flyreg_core.cut import dissect
from flyreg_core.cut_height import CutParameters
from flyreg_core.flatten import FlattenParameters
from flyreg_core.frame import BrainFrame
from flyreg_core.halves import lay_flat
from flyreg_core.handles import HandleParameters
from flyreg_core.landmarks import HALVES, HalfName, LandmarkPair, LandmarkParameters
from flyreg_core.lift import Registration, build_locators, find_ends, register
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.pose import find_frame
from flyreg_core.smooth import SmoothParameters, smooth
from flyreg_core.solid import SolidParameters, VoxelSolid, voxelize
from flyreg_core.thin_plate_spline import ThinPlateSpline, fit_thin_plate_spline
from flyreg_core.torus import Torus, make_torus
from flyreg_core.trim import TrimParameters


@dataclass(frozen=True, eq=False)
class PreparedBrain:
    """A brain and what each stage made of it."""

    original: SurfaceMesh
    solid: VoxelSolid
    torus: Torus
    smoothed: Floats
    flat: FlatBrain

    def __repr__(self) -> str:
        return f"PreparedBrain of {len(self.torus.surface.vertices)} vertices"  # not all of them

    @property
    def surface(self) -> SurfaceMesh:
        """The main brain with its cuts drawn."""
        return self.flat.dissection.surface


def prepare(
    original: SurfaceMesh,
    voxels_across: int = SolidParameters().voxels_across,
    frame: BrainFrame | None = None,
) -> PreparedBrain:
    """Take a surface through the stages up to the flat halves, in the frame found or a given one."""
    frame = frame or find_frame(original)
    solid = voxelize(original, frame, SolidParameters(voxels_across), progress.ignore)
    torus = make_torus(original, solid, TrimParameters(), HandleParameters(), progress.ignore)
    smoothed = smooth(
        torus.surface.vertices, torus.surface.faces, SmoothParameters(), progress.ignore
    )
    dissection = dissect(torus, torus.surface, smoothed, CutParameters())
    curves = find_curves(dissection, torus.frame)
    halves = {
        half: lay_flat(dissection, curves, half, FlattenParameters(), progress.ignore)
        for half in HALVES
    }
    flat = FlatBrain(dissection, torus.frame, curves, halves)
    return PreparedBrain(original, solid, torus, smoothed, flat)


def register_pair(
    source: PreparedBrain,
    target: PreparedBrain,
    parameters: LandmarkParameters,
    smoothing: float = 1e-3,
    pairs: tuple[LandmarkPair, ...] = (),
) -> Registration:
    """Register one prepared brain to another by its boundary pairs and the given ones."""
    pairs = boundary_pairs(source.flat, target.flat, parameters) + pairs
    landmarks = place_landmarks(source.flat, target.flat, pairs)
    splines = fit_splines(landmarks, smoothing)
    places = {half: splines[half](source.flat.halves[half].plane) for half in HALVES}
    caps = find_caps(source.flat.dissection, source.flat.curves, source.flat.added)
    locators = build_locators(target.flat)
    return register(
        source.flat, caps, target.flat, locators, places, find_ends(landmarks), progress.ignore
    )


def fit_splines(
    landmarks: tuple[PlacedLandmark, ...], smoothing: float
) -> dict[HalfName, ThinPlateSpline]:
    """Fit one spline for each half to the landmarks that act in it."""
    splines = {}
    for half in HALVES:
        acting = [mark for mark in landmarks if half in mark.plane]
        ends = np.array([mark.plane[half] for mark in acting])
        weights = np.array([mark.pair.weight for mark in acting])
        splines[half] = fit_thin_plate_spline(ends[:, 0], ends[:, 1], weights, smoothing)
    return splines
