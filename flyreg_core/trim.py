"""Stage 2a: find the necks of the optic lobes and cut the lobes off."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from flyreg_core.errors import MeshError
from flyreg_core.frame import ANTERO_POSTERIOR, LEFT_RIGHT
from flyreg_core.mesh import Floats, Integers
from flyreg_core.solid import VoxelSolid, largest_component

NECK_SEARCH = (0.45, 0.75)
"""Where a neck is looked for, as shares of the way from the midline to the side of the brain."""
PROFILE_BLUR = 0.02
"""Width of the blur over the silhouette's height, as a share of the brain's width."""

FARTHEST_BETWEEN = 0.45
"""How far from a voxel's centre the lowest place of a neck is at most, voxels: just short of where a
plane half a voxel further in would meet the centre of another, and rounding would decide about it."""

FARTHEST = 0.95
"""How far out a plane may be carried, as a share of the way to the side of the brain."""


@dataclass(frozen=True)
class TrimParameters:
    """Where the optic lobes are cut off, micrometres from the midplane; None finds it."""

    right: float | None = None  # negative
    left: float | None = None

    def mirrored(self) -> TrimParameters:
        """Return the same planes in a frame with left and right exchanged."""
        right, left = (None if x is None else -x for x in (self.left, self.right))
        return TrimParameters(right, left)

    def completed_by(self, other: TrimParameters) -> TrimParameters:
        """Return the parameters with what they leave open taken from others."""
        return TrimParameters(
            other.right if self.right is None else self.right,
            other.left if self.left is None else self.left,
        )


@dataclass(frozen=True)
class TrimPlanes:
    """The two planes that bound the main brain, by their left-right coordinates in its frame."""

    right: float
    left: float

    def mirrored(self) -> TrimPlanes:
        """Return the same planes in a frame with left and right exchanged."""
        return TrimPlanes(right=-self.left, left=-self.right)


def within_solid(planes: TrimPlanes, solid: VoxelSolid) -> TrimParameters:
    """Return planes moved inwards to where there still is a brain to be trimmed.

    A source may lack an optic lobe that the target has.
    """
    sides = solid.coordinates(LEFT_RIGHT)[solid.inside.any(axis=(1, 2))]
    return TrimParameters(
        max(planes.right, FARTHEST * float(sides.min())),
        min(planes.left, FARTHEST * float(sides.max())),
    )


def find_trim_planes(solid: VoxelSolid, parameters: TrimParameters) -> TrimPlanes:
    """Return the planes at the necks of the optic lobes, or where the parameters put them.

    A neck is where the silhouette seen from the front is least high, between the midline and the
    side of the brain (3.1 B of the paper leaves this to the user).
    """
    x = solid.coordinates(LEFT_RIGHT)
    silhouette = np.asarray(solid.inside.any(axis=ANTERO_POSTERIOR))
    occupied = np.flatnonzero(silhouette.any(axis=1))
    height = scipy.ndimage.gaussian_filter1d(
        silhouette.sum(axis=1).astype(float), PROFILE_BLUR * len(occupied)
    )
    middle, reach = (occupied[0] + occupied[-1]) / 2, (occupied[-1] - occupied[0]) / 2
    nearest, farthest = (round(share * reach) for share in NECK_SEARCH)
    steps = np.arange(nearest, farthest + 1)
    towards_right = np.round(middle - steps).astype(int)
    towards_left = np.round(middle + steps).astype(int)
    between = solid.pitch / 2  # no voxel lies on a plane where heights are level
    right = float(x[0]) + solid.pitch * _lowest(height, towards_right) + between
    left = float(x[0]) + solid.pitch * _lowest(height, towards_left) - between
    return TrimPlanes(
        right=right if parameters.right is None else parameters.right,
        left=left if parameters.left is None else parameters.left,
    )


def _lowest(height: Floats, places: Integers) -> float:
    """Return where the height is least: the lowest point of the parabola through three places.

    To a fraction of a voxel, so that a neck which is a little different moves the plane a little.
    """
    lowest = int(places[np.argmin(height[places])])
    before, here, after = height[lowest - 1 : lowest + 2]
    curvature = before - 2 * here + after
    if curvature <= 0:
        return lowest
    vertex = (before - after) / (2 * curvature)
    return lowest + float(np.clip(vertex, -FARTHEST_BETWEEN, FARTHEST_BETWEEN))


def trim(solid: VoxelSolid, planes: TrimPlanes) -> VoxelSolid:
    """Return the largest piece of the solid between the two planes.

    Raises
    ------
    MeshError
        The planes leave nothing between them.
    """
    x = solid.coordinates(LEFT_RIGHT)
    kept = (x > planes.right) & (x < planes.left)
    inside = solid.inside & kept[:, None, None]
    if not inside.any():
        raise MeshError(
            f"nothing of the brain lies between the trim planes at {planes.right:.0f} and "
            f"{planes.left:.0f} um; it spans {x[0]:.0f} to {x[-1]:.0f} um there, so move the planes"
        )
    return replace(solid, inside=largest_component(inside))


def plane_depth(solid: VoxelSolid, planes: TrimPlanes) -> Floats:
    """Return (nx,) how far voxels lie inside the nearer trim plane, micrometres; negative outside."""
    x = solid.coordinates(LEFT_RIGHT)
    return np.asarray(np.minimum(x - planes.right, planes.left - x))
