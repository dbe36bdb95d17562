"""How far a registration's landmarks agree: leave-one-out errors, smoothing, who folds the surface."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.spatial import KDTree

from flyreg_core.correspondence import FlatBrain, PlacedLandmark
from flyreg_core.cross_validation import (
    CrossValidation,
    Spectrum,
    cross_validate,
    find_spectrum,
    leave_one_out,
    leverages,
)
from flyreg_core.errors import LandmarkError
from flyreg_core.landmarks import HALVES, HalfName
from flyreg_core.lift import Locators, Registration, WarpedHalf, lift_places
from flyreg_core.locate import TriangleGrid, find_triangles, strip_grid
from flyreg_core.mesh import Floats
from flyreg_core.thin_plate_spline import ThinPlateSpline, fit_thin_plate_spline
from flyreg_core.trade_off import TradeOff, find_trade_off, weighted_squares


@dataclass(frozen=True, eq=False)
class Judgement:
    """What the landmarks of a registration tell about each other."""

    cross_validation: CrossValidation
    trade_off: TradeOff  # of the same smoothings
    leave_one_out_um: Mapping[str, float]  # by id of the landmarks in use
    leverage: Mapping[str, float]  # 0 to 1: how far a landmark decides its own place, by id
    folds_by_landmark: Mapping[str, int]  # vertices moved to mend folds, by id of who is nearest
    there_and_back_um: Floats  # (n,) by how much vertices of the halves miss where they came from


def judge(
    source: FlatBrain,
    target: FlatBrain,
    locators: Locators,
    landmarks: tuple[PlacedLandmark, ...],
    registration: Registration,
    smoothing: float,
) -> Judgement:
    """Return how well each landmark is foretold by all others, and which ones fold the surface.

    A landmark that both halves share has the larger of its two errors, and of its leverages. The way
    back is the spline that registers the target to the source with the same pairs, weights and
    smoothing.
    """
    spectra: list[Spectrum] = []
    squares: list[Floats] = []
    errors: dict[str, float] = {}
    shares: dict[str, float] = {}
    folds: Counter[str] = Counter()
    surface = target.dissection.surface.vertices
    returns = []
    for half in HALVES:
        acting = [mark for mark in landmarks if half in mark.plane]
        ends = np.array([mark.plane[half] for mark in acting])
        weights = np.array([mark.weight for mark in acting])
        spectrum = find_spectrum(ends[:, 0], ends[:, 1], weights)
        spectra.append(spectrum)
        points = np.array([mark.target_point for mark in acting])
        lift = partial(lift_places, half, target, locators.halves[half], surface=surface)
        squares.append(weighted_squares(spectrum, ends[:, 1], points, lift))
        misses = leave_one_out(spectrum, smoothing)
        for mark, share in zip(acting, leverages(spectrum, smoothing).tolist(), strict=True):
            if mark.weight > 0:
                shares[mark.pair.id] = max(share, shares.get(mark.pair.id, 0.0))
        known = np.flatnonzero(np.isfinite(misses).all(axis=1))
        foretold = ends[known, 1] - misses[known]
        away = np.linalg.norm(lift(foretold) - points[known], axis=1)
        for number, error in zip(known.tolist(), away.tolist(), strict=True):
            name = acting[number].pair.id
            errors[name] = max(error, errors.get(name, 0.0))
        folded = source.halves[half].plane[registration.halves[half].is_mended]
        folds.update(_nearest_ids(acting, ends[:, 0], folded))
        with suppress(LandmarkError):  # targets at one place cannot be told apart on the way back
            back = fit_thin_plate_spline(ends[:, 1], ends[:, 0], weights, smoothing)
            grid, warped = locators.halves[half], registration.halves[half]
            returns.append(_misses(source, target, half, grid, warped, back))
    returned = np.concatenate(returns) if len(returns) == len(HALVES) else np.zeros(0)
    trade_off = find_trade_off(spectra, squares)
    by_landmark = dict(folds.most_common())
    return Judgement(cross_validate(spectra), trade_off, errors, shares, by_landmark, returned)


def _nearest_ids(acting: Sequence[PlacedLandmark], sources: Floats, places: Floats) -> list[str]:
    """Return for each (k, 2) place of the rectangle the id of the nearest landmark in use."""
    used = [number for number, mark in enumerate(acting) if mark.weight > 0]
    nearest = np.asarray(KDTree(sources[used]).query(places)[1])
    return [acting[used[number]].pair.id for number in nearest.tolist()]


def _misses(
    source: FlatBrain,
    target: FlatBrain,
    half: HalfName,
    grid: TriangleGrid,
    warped: WarpedHalf,
    back: ThinPlateSpline,
) -> Floats:
    """Return how far from where they were the vertices of a half are brought back, micrometres.

    They lie on the target's faces, whose vertices the way back carries to the source's surface.
    """
    own, other, surface = source.halves[half], target.halves[half], source.dissection.surface
    carried = lift_places(half, source, strip_grid(own.flat), back(other.plane), surface.vertices)
    face, barycentric = find_triangles(grid, warped.flat.uv, warped.face)
    points = np.einsum("ij,ijk->ik", barycentric, carried[other.faces[face]])
    return np.asarray(np.linalg.norm(points - surface.vertices[own.vertex_of], axis=1))
