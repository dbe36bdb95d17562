"""Stage 1: whatever was read becomes solid voxels, inside or outside."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from flyreg_core.errors import MeshError
from flyreg_core.frame import DORSO_VENTRAL, LEFT_RIGHT, BrainFrame
from flyreg_core.mesh import Booleans, Floats, Integers, SurfaceMesh
from flyreg_core.progress import Report
from flyreg_core.winding_number import winding_numbers

KUHN_OFFSETS = np.array([offset for offset in np.ndindex(2, 2, 2) if any(offset)], dtype=np.int64)
"""The 7 positive steps of the Kuhn grid; with their opposites, the 14 neighbours of a voxel."""


def kuhn_structure() -> Booleans:
    """Return the 3 x 3 x 3 structuring element of the 14-neighbourhood."""
    structure = np.zeros((3, 3, 3), dtype=bool)
    for offset in np.vstack([KUHN_OFFSETS, -KUHN_OFFSETS, [[0, 0, 0]]]):
        structure[tuple(offset + 1)] = True
    return structure


FEWEST_VOXELS = 8
MARGIN = 2
"""Layers of voxels around the brain."""


@dataclass(frozen=True)
class SolidParameters:
    """How finely a brain is cut into voxels."""

    voxels_across: int = 60  # from the dorsal to the ventral end


@dataclass(frozen=True, eq=False)
class VoxelSolid:
    """A solid on a cubic grid along the axes of the animal, whose outermost layer is outside."""

    inside: Booleans  # (nx, ny, nz)
    frame: BrainFrame
    origin: Floats  # (3,), centre of voxel (0, 0, 0) in the frame, micrometres
    pitch: float  # edge of a voxel, micrometres
    winding_number: NDArray[np.float32] | None = None  # (nx, ny, nz) of the surface it came from

    def coordinates(self, axis: int) -> Floats:
        """Return the voxel centres along one axis of the frame, micrometres."""
        return np.asarray(self.origin[axis] + self.pitch * np.arange(self.inside.shape[axis]))

    def positions(self, index: tuple[np.ndarray, ...]) -> Floats:
        """Return where the (k, 3) voxels of an index such as `np.nonzero` gives lie in the file."""
        return self.frame.points(self.origin + self.pitch * np.stack(index, axis=-1))

    def voxels(self, points: Floats) -> Integers:
        """Return the (k, 3) index of the voxel nearest to each point of the file."""
        steps = (self.frame.coordinates(points) - self.origin) / self.pitch
        return np.asarray(np.clip(np.round(steps), 0, np.array(self.inside.shape) - 1), int)

    def mirrored(self) -> VoxelSolid:
        """Return the same voxels in the same places, counted from the other side."""
        around = self.winding_number
        return replace(
            self,
            inside=self.inside[::-1].copy(),
            frame=self.frame.mirrored(),
            origin=np.array([-self.coordinates(LEFT_RIGHT)[-1], *self.origin[1:]]),
            winding_number=None if around is None else around[::-1].copy(),
        )


def voxelize(
    mesh: SurfaceMesh, frame: BrainFrame, parameters: SolidParameters, report: Report
) -> VoxelSolid:
    """Return the voxels inside a surface, whatever holes, sheets and crossings it has.

    A voxel is inside where the generalised winding number exceeds one half.

    Parameters
    ----------
    mesh : SurfaceMesh
        Any triangles whose normals point outwards, micrometres.

    Raises
    ------
    MeshError
        Fewer than 8 voxels across are asked for, or no voxel is inside.

    Notes
    -----
    The grid is symmetric to the midplane, so that a brain and its mirror image get the same voxels.

    References
    ----------
    Jacobson, Kavan, Sorkine-Hornung, Robust inside-outside segmentation using generalized winding
    numbers, ACM TOG 32(4), 2013, doi:10.1145/2461912.2461916. Fast evaluation: Barill et al.,
    ACM TOG 37(4), 2018, doi:10.1145/3197517.3201337.
    """
    if parameters.voxels_across < FEWEST_VOXELS:
        raise MeshError(
            f"{parameters.voxels_across} voxels across cannot show a brain; use at least {FEWEST_VOXELS}"
        )
    coordinates = frame.coordinates(mesh.vertices)
    pitch = float(np.ptp(coordinates[:, DORSO_VENTRAL])) / parameters.voxels_across
    first = np.floor(coordinates.min(axis=0) / pitch).astype(int) - MARGIN
    last = np.ceil(coordinates.max(axis=0) / pitch).astype(int) + MARGIN
    shape = tuple(last - first + 1)
    empty = VoxelSolid(np.zeros(shape, dtype=bool), frame, pitch * first, pitch)
    grid = empty.origin + pitch * np.indices(shape).reshape(3, -1).T
    text = "finding the inside of the brain"
    winding_number = frame.outwards * winding_numbers(grid, coordinates, mesh.faces, report, text)
    inside = (winding_number > 0.5).reshape(shape)
    if not inside.any():
        raise MeshError(
            "the surface encloses nothing at this resolution, or is turned inside out; "
            "check the file or use more voxels"
        )
    around = winding_number.reshape(shape).astype(np.float32)
    return replace(empty, inside=inside, winding_number=around)


def close_solid(solid: VoxelSolid, radius: float) -> VoxelSolid:
    """Return the largest component of a solid with cracks closed and cavities filled.

    Parameters
    ----------
    radius : float
        Cracks, tunnels and mouths of cavities up to twice as wide are closed, voxels.
    """
    return replace(solid, inside=largest_component(close_cracks(solid.inside, radius)))


def close_cracks(inside: Booleans, radius: float) -> Booleans:
    """Return the morphological closing by a ball of a radius in voxels.

    Raw surfaces have sheets inside the brain whose hollows reach the outside through cracks; such
    pockets are not anatomy and would flatten to nothing.
    """
    margin = int(np.ceil(radius)) + 1
    padded = np.pad(inside, margin)
    dilated = scipy.ndimage.distance_transform_edt(~padded) <= radius
    closed = scipy.ndimage.distance_transform_edt(dilated) > radius
    return np.asarray(closed[(slice(margin, -margin),) * 3] | inside)


def largest_component(inside: Booleans) -> Booleans:
    """Return the largest component of a solid, which has one, its cavities filled, on the Kuhn grid."""
    structure = kuhn_structure()
    labels, _ = scipy.ndimage.label(inside, structure)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return np.asarray(scipy.ndimage.binary_fill_holes(labels == sizes.argmax(), structure))
