"""How one brain has to be turned, moved and stretched to lie on another."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flyreg_core.affine import AffineMap
from flyreg_core.anatomy import find_middle
from flyreg_core.closest_points import Freedom, fit_skins, misfit
from flyreg_core.frame import BrainFrame
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.progress import Report, ignore, within
from flyreg_core.skin import Skin, find_skin
from flyreg_core.surface_distance import distances_to_surface

SAMPLES = 8000
"""Points drawn on each surface; half or more of them lie outside."""
QUERIES, FINAL_QUERIES = 700, 2500
Rounds = tuple[tuple[Freedom, int], ...]
FIRST_ROUNDS: Rounds = (("rigid", 6), ("similarity", 6))
NEXT_ROUNDS: Rounds = (("affine", 8),)
FINAL_ROUNDS = 40
HOPELESS = 1.4
"""Poses whose first misfit is this many times the least are not followed up."""
CLEARLY = 0.93
"""A pose is clearly better than another if its misfit is below this share of the other's."""

Signs = tuple[int, int, int]
OWN: Signs = (1, 1, 1)
FRONT_AND_TOP = ((1, 1), (-1, -1), (-1, 1), (1, -1))


@dataclass(frozen=True)
class Candidate:
    """A pose that was tried."""

    signs: Signs  # -1 where left, ventral or posterior of the source's own frame is turned round
    misfit_um: float  # mean difference of the outsides, normals included


@dataclass(frozen=True)
class _Pose:
    by: AffineMap  # between coordinates of the two frames
    misfit_um: float


@dataclass(frozen=True, eq=False)
class Alignment:
    """The affine map that lays a source on a target."""

    to_target: AffineMap
    frame: BrainFrame  # of the source, as the target's frame has it
    residual_um: float  # mean distance between the surfaces after the map, both ways
    candidates: tuple[Candidate, ...]  # the chosen one first, then the best
    is_sure: bool  # whether front and top are clearly those, or clearly the own frame's
    is_side_sure: bool  # whether it is clear that the source is, or is not, a mirror image

    def turned_round(self, frame: BrainFrame) -> Alignment:
        """Return how the target lies on the source; the target's frame is given."""
        return replace(self, to_target=self.to_target.inverse(), frame=frame)

    @property
    def is_mirrored(self) -> bool:
        """Tell whether the source shows the mirror image of the target."""
        return self.to_target.is_mirroring


def align(
    source: SurfaceMesh,
    target: SurfaceMesh,
    source_frame: BrainFrame,
    target_frame: BrainFrame,
    report: Report = ignore,
    are_frames_stated: bool = False,
) -> Alignment:
    """Return the affine map that lays one brain on another, whichever way each was turned.

    The ways to match the axes of the two frames are tried, from a turn to an affine map. The
    own frames are kept unless another pose fits clearly better: brains are so much like their own
    mirror image that shape seldom tells which side is left.

    Parameters
    ----------
    are_frames_stated : bool
        Whether the user said how the brains lie, so that nothing else is chosen.

    Raises
    ------
    MeshError
        A surface encloses nothing.
    """
    report(0.0, "aligning the brains")
    skins = (_own_skin(source, source_frame), _own_skin(target, target_frame))
    tried = _tried_poses(*skins, within(report, 0.1, 0.7))
    chosen = OWN if are_frames_stated else _choice(tried)
    last = within(report, 0.7, 0.9)
    best = fit_skins(*skins, tried[chosen].by, "affine", FINAL_ROUNDS, FINAL_QUERIES, last)
    to_target = _from_file(target_frame).inverse().after(best).after(_from_file(source_frame))
    ranked = sorted(tried, key=lambda signs: (signs != chosen, tried[signs].misfit_um))
    elsewhere = [tried[signs].misfit_um for signs in ranked if signs[1:] != chosen[1:]]
    other_side = tried[-chosen[0], chosen[1], chosen[2]].misfit_um
    misfit_um = tried[chosen].misfit_um
    return Alignment(
        to_target,
        _carried_back(target_frame, to_target),
        _residual(source, target, skins, (source_frame, target_frame), to_target),
        tuple(Candidate(signs, tried[signs].misfit_um) for signs in ranked),
        misfit_um < CLEARLY * min(elsewhere),
        misfit_um < CLEARLY * other_side,
    )


def _own_skin(mesh: SurfaceMesh, frame: BrainFrame) -> Skin:
    """Return the skin of a brain in the coordinates of its frame."""
    return find_skin(SurfaceMesh(frame.coordinates(mesh.vertices), mesh.faces), SAMPLES)


def _from_file(frame: BrainFrame) -> AffineMap:
    """Return the map from coordinates of the file to those of the frame."""
    return AffineMap(frame.axes, -frame.axes @ frame.origin)


def _tried_poses(source: Skin, target: Skin, report: Report) -> dict[Signs, _Pose]:
    """Return a map for each way to match the axes; both sides only where front and top are likely."""
    scale = _size(target) / _size(source)
    tried = {}
    for number, (ventral, posterior) in enumerate(FRONT_AND_TOP):
        part = within(report, number / 8, (number + 1) / 8)
        signs = (ventral * posterior, ventral, posterior)  # a turn, no reflection
        start = AffineMap(scale * np.diag(signs), np.zeros(3))
        tried[signs] = _fitted(source, target, start, FIRST_ROUNDS, part)
    least = min(pose.misfit_um for pose in tried.values())
    likely = [signs for signs in tried if tried[signs].misfit_um < HOPELESS * least or signs == OWN]
    for number, signs in enumerate(likely):
        part = within(report, 0.5 + number / len(likely) / 2, 0.5 + (number + 1) / len(likely) / 2)
        turn = tried[signs].by
        tried[signs] = _fitted(source, target, turn, NEXT_ROUNDS, within(part, 0.0, 0.5))
        other = (-signs[0], *signs[1:])
        turn = turn.after(AffineMap(np.diag([-1.0, 1.0, 1.0]), np.zeros(3)))
        tried[other] = _fitted(source, target, turn, NEXT_ROUNDS, within(part, 0.5, 1.0))
    return tried


def _fitted(source: Skin, target: Skin, start: AffineMap, rounds: Rounds, report: Report) -> _Pose:
    by = start
    for number, (freedom, count) in enumerate(rounds):
        part = within(report, number / len(rounds), (number + 1) / len(rounds))
        by = fit_skins(source, target, by, freedom, count, QUERIES, part)
    return _Pose(by, misfit(source, target, by, QUERIES))


def _choice(tried: dict[Signs, _Pose]) -> Signs:
    """Return the pose that fits best, or the most expected one that fits about as well."""
    expected = [OWN, *(signs for signs in tried if signs[0] == signs[1] * signs[2]), *tried]
    least = min(pose.misfit_um for pose in tried.values())
    return next(signs for signs in expected if CLEARLY * tried[signs].misfit_um <= least)


def _size(skin: Skin) -> float:
    """Return the root mean square distance from the middle, near the midline."""
    lateral = np.abs(skin.points[:, 0])
    return find_middle(lateral, skin.points[:, 1:], np.ones(len(lateral)))[1]


def _carried_back(frame: BrainFrame, to_frame: AffineMap) -> BrainFrame:
    """Return the frame that an affine map takes about to another one."""
    back = to_frame.inverse()
    left, _, right = np.linalg.svd(frame.axes @ back.matrix.T)
    return BrainFrame(back(frame.origin), left @ right)


def _residual(
    source: SurfaceMesh,
    target: SurfaceMesh,
    skins: tuple[Skin, Skin],
    frames: tuple[BrainFrame, BrainFrame],
    to_target: AffineMap,
) -> float:
    """Return the mean distance of the skins to the other surface, both ways, micrometres."""
    moved = SurfaceMesh(to_target(source.vertices), source.faces)
    points: list[Floats] = [
        frame.points(skin.points) for skin, frame in zip(skins, frames, strict=True)
    ]
    there = distances_to_surface(to_target(points[0]), target, ignore)
    back = distances_to_surface(points[1], moved, ignore)
    return float((there.mean() + back.mean()) / 2)
