"""How a brain lies in its file: where its front, its top and its midline are, by its shape alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from flyreg_core.anatomy import find_middle, find_postures
from flyreg_core.errors import InputError
from flyreg_core.frame import LEFT_RIGHT, BrainFrame
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.occupancy import find_occupancy, find_own_axes
from flyreg_core.symmetry import find_symmetry_plane

AXIS_LETTERS = {"L": 0, "R": 0, "V": 1, "D": 1, "P": 2, "A": 2}
"""The row of a frame along which each letter of a stated pose lies."""
SURE = 0.075
"""How much larger the best mean log likelihood must be than that of another posture."""
LEAST_LEAD = 0.002
"""A shape with a smaller lead is the same turned round, which no brain is."""
MOST_STRETCHED = 1.57
"""By what factor proportions may differ from the mean fly's; flat and swept brains come to 1.46."""
MOST_FOREIGN = 1.3
"""Relative entropy that is believed, nats; brains without their optic lobes have up to 1.2."""


@dataclass(frozen=True)
class PoseParameters:
    """How a brain lies in its file; None finds it.

    Three letters, for x, y and z: towards which side of the animal, Left or Right, Dorsal or
    Ventral, Anterior or Posterior, the coordinate grows. "LVP" is how the field's templates lie.
    """

    axes: str | None = None

    def __post_init__(self) -> None:
        rows = sorted(AXIS_LETTERS.get(letter, -1) for letter in self.axes or "LVP")
        if rows != [0, 1, 2]:
            raise InputError(
                f"the pose must name, for x, y and z, the side of the animal to which they grow, such "
                f"as LVP (left, ventral, posterior; or R, D, A), not {self.axes}"
            )

    def applied_to(self, frame: BrainFrame) -> BrainFrame:
        """Return the frame with its axes exchanged and turned round to be most like the stated."""
        if self.axes is None:
            return frame
        stated = np.zeros((3, 3))
        for column, letter in enumerate(self.axes):
            stated[AXIS_LETTERS[letter], column] = 1 if letter in "LVP" else -1
        likeness = stated @ frame.axes.T
        rows, own = scipy.optimize.linear_sum_assignment(-np.abs(likeness))
        turn = np.zeros((3, 3))
        turn[rows, own] = np.where(likeness[rows, own] < 0, -1.0, 1.0)
        return BrainFrame(frame.origin, turn @ frame.axes)


@dataclass(frozen=True, eq=False)
class Pose:
    """The frame of a brain by its shape, and how far to trust it."""

    frame: BrainFrame  # never mirrored: which side is left follows from the front and the top
    likeness: float  # correlation of the surface with its mirror image, up to 1
    lead: float  # by how much it is likelier than another front or top, in mean log likelihood
    scale: Floats  # (3,), what makes it as wide, high and deep as the mean fly, up to a factor
    foreignness: float  # relative entropy of the inside to the mean fly's, nats

    @property
    def is_sure(self) -> bool:
        """Tell whether front and top are beyond doubt."""
        return self.lead > SURE

    def check_is_brain(self) -> None:
        """Tell whether the shape can be a whole fly brain, with optic lobes or without.

        Raises
        ------
        InputError
            It has no front and no top, or the proportions or the form of no fly brain.
        """
        width, height, depth = self.scale
        for name, stretch in (("wide", height / width), ("deep", height / depth)):
            if not 1 / MOST_STRETCHED <= stretch <= MOST_STRETCHED:
                raise InputError(
                    f"the shape is {stretch:.1f} times as {name}, for its height, as a fly's brain, so "
                    "it does not look like one; check that the file holds a whole brain, or state "
                    "how it lies"
                )
        if self.lead < LEAST_LEAD:
            raise InputError(
                "the shape is the same turned round, without a front and a top, so it does not look "
                "like a brain; check that the file holds one, or state how it lies"
            )
        if self.foreignness > MOST_FOREIGN:
            raise InputError(
                "the inside of the shape lies where hardly any of a fly's brain does, so it does not "
                "look like one; check that the file holds a whole brain, closed, or state how it lies"
            )


def find_frame(mesh: SurfaceMesh, stated: PoseParameters | None = None) -> BrainFrame:
    """Return the frame of a brain, see `find_pose`; what was stated about it is believed.

    Raises
    ------
    InputError
        Nothing was stated and it does not look like a brain, or see `find_pose`.
    """
    pose = find_pose(mesh)
    if stated is None or stated.axes is None:
        pose.check_is_brain()
        return pose.frame
    return stated.applied_to(pose.frame)


def find_pose(mesh: SurfaceMesh) -> Pose:
    """Return where left, ventral and posterior are in a brain that lies anyhow in its file.

    The midplane is where the inside is most like its mirror image; front and top are such that the
    parts of the brain lie where they do in the mean fly. The frame turns, moves, mirrors and scales
    with the mesh, but is right-handed even if the mesh shows a mirror image, which shape alone
    cannot tell.

    Parameters
    ----------
    mesh : SurfaceMesh
        The surface of a brain or a trimmed brain: open, torn, with sheets inside, without one optic
        lobe or both.

    Raises
    ------
    InputError
        No direction is clearly the left and right, as in a ball, or nothing is enclosed.
    """
    own = find_own_axes(mesh)
    occupancy = find_occupancy(mesh, own)
    plane = find_symmetry_plane(occupancy)
    across = np.linalg.svd(plane.normal[np.newaxis])[2][1:]
    points, share = occupancy.halved().filled()
    lateral = np.abs(points @ plane.normal - plane.height)
    best, *others = find_postures(lateral, points @ across.T, share)
    origin = plane.height * plane.normal + best.center @ across
    ventral, posterior = (side @ across @ own.axes for side in (best.ventral, best.posterior))
    axes = np.stack([np.cross(ventral, posterior), ventral, posterior])
    lead = min(
        (
            best.log_likelihood - other.log_likelihood
            for other in others
            if other.ventral @ best.ventral < 0.7 or other.posterior @ best.posterior < 0.7
        ),
        default=np.inf,
    )
    _, unit = find_middle(lateral, points @ across.T, share)
    volume = share.sum() * (2 * occupancy.pitch / unit) ** 3 / 2  # of one side
    foreignness = -best.log_likelihood - float(np.log(volume))
    frame = BrainFrame(own.points(origin), axes)
    return Pose(frame, plane.likeness, float(lead), best.scale, foreignness)


def leans_right(mesh: SurfaceMesh, frame: BrainFrame) -> bool:
    """Tell which side reaches farther, by the third moment of the surface.

    No brain is quite symmetric, and its mirror image leans the other way.
    """
    lateral = frame.coordinates(mesh.vertices[mesh.faces].mean(axis=1))[:, LEFT_RIGHT]
    return bool(mesh.face_areas @ lateral**3 < 0)
