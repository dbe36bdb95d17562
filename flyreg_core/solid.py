"""Stage 1: whatever was read becomes solid voxels, inside or outside."""

from __future__ import annotations

from dataclasses import dataclass, replace

import igl
import numpy as np
from scipy import ndimage

from flyreg_core.errors import MeshError
from flyreg_core.frame import find_frame
from flyreg_core.mesh import Booleans, Floats, SurfaceMesh
from flyreg_core.progress import Report, in_chunks

KUHN_OFFSETS = np.array([offset for offset in np.ndindex(2, 2, 2) if any(offset)], dtype=np.int64)
"""The 7 positive steps of the Kuhn grid; with their opposites, the 14 neighbours of a voxel."""


def kuhn_structure() -> Booleans:
    """Return the 3 x 3 x 3 structuring element of the 14-neighbourhood."""
    structure = np.zeros((3, 3, 3), dtype=bool)
    for offset in np.vstack([KUHN_OFFSETS, -KUHN_OFFSETS, [[0, 0, 0]]]):
        structure[tuple(offset + 1)] = True
    return structure


FEWEST_VOXELS = 8


@dataclass(frozen=True)
class SolidParameters:
    """How finely a brain is cut into voxels."""

    voxels_across: int = 60  # from the dorsal to the ventral end


@dataclass(frozen=True, eq=False)
class VoxelSolid:
    """A solid on a cubic grid whose outermost layer is outside."""

    inside: Booleans  # (nx, ny, nz)
    origin: Floats  # (3,), centre of voxel (0, 0, 0), micrometres
    pitch: float  # edge of a voxel, micrometres

    def coordinates(self, axis: int) -> Floats:
        """Return the positions of the voxel centres along one axis, micrometres."""
        return np.asarray(self.origin[axis] + self.pitch * np.arange(self.inside.shape[axis]))

    def positions(self, index: tuple[np.ndarray, ...]) -> Floats:
        """Return the (k, 3) centres of the voxels of an index such as `np.nonzero` gives."""
        return np.asarray(self.origin + self.pitch * np.stack(index, axis=-1))


def voxelize(mesh: SurfaceMesh, parameters: SolidParameters, report: Report) -> VoxelSolid:
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
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    pitch = float(np.ptp(mesh.vertices[:, find_frame(mesh.vertices).dorso_ventral]))
    pitch /= parameters.voxels_across
    origin = low - 2 * pitch
    shape = tuple(np.ceil((high - low) / pitch).astype(int) + 5)
    grid = origin + pitch * np.moveaxis(np.indices(shape), 0, -1).reshape(-1, 3)
    bvh = igl.FastWindingNumberBVH()
    bvh.init(mesh.vertices, mesh.faces)
    winding_number = in_chunks(bvh.winding_number, grid, report, "finding the inside of the brain")
    inside = (winding_number > 0.5).reshape(shape)
    if not inside.any():
        raise MeshError(
            "the surface encloses nothing at this resolution, or is turned inside out; "
            "check the file or use more voxels"
        )
    return VoxelSolid(inside, origin, pitch)


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
    dilated = ndimage.distance_transform_edt(~padded) <= radius
    closed = ndimage.distance_transform_edt(dilated) > radius
    return np.asarray(closed[(slice(margin, -margin),) * 3] | inside)


def largest_component(inside: Booleans) -> Booleans:
    """Return the largest component of a solid, which has one, its cavities filled, on the Kuhn grid."""
    structure = kuhn_structure()
    labels, _ = ndimage.label(inside, structure)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return np.asarray(ndimage.binary_fill_holes(labels == sizes.argmax(), structure))
