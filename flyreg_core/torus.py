"""Stage 2: the main brain as one closed surface with exactly one handle."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from flyreg_core.carve import Carving, Handle, carve
from flyreg_core.errors import TopologyError
from flyreg_core.frame import BrainFrame, find_frame
from flyreg_core.isosurface import extract_surface
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.progress import Report, within
from flyreg_core.solid import VoxelSolid, close_solid, kuhn_structure
from flyreg_core.surface_distance import distances_to_surface
from flyreg_core.trim import TrimParameters, TrimPlanes, find_trim_planes, plane_depth, trim

CLOSING = (1.5, 1.0, 0.0)
"""Radii by which cracks are closed, voxels; the next is tried where one closes the oesophagus."""
SMALLEST_DEPTH = 0.05
"""Depth given to a voxel that lies on the other side of the original surface, in voxels."""


@dataclass(frozen=True, eq=False)
class Torus:
    """The main brain: closed, one component, one handle."""

    surface: SurfaceMesh
    frame: BrainFrame
    planes: TrimPlanes
    pitch: float  # edge of the voxels it was drawn from, micrometres
    handles: tuple[Handle, ...]  # widest first, exactly one of them the oesophagus
    membrane: Floats  # (k, 3), points that span the oesophagus at its narrowest place, micrometres
    filled_um3: float  # volume that was added to close the other handles

    @property
    def oesophagus(self) -> Handle:
        """The handle that was kept open."""
        return next(handle for handle in self.handles if handle.is_oesophagus)


def make_torus(
    original: SurfaceMesh, solid: VoxelSolid, parameters: TrimParameters, report: Report
) -> Torus:
    """Return the main brain of a solid: trimmed, carved to one handle, drawn as a closed surface.

    Parameters
    ----------
    original : SurfaceMesh
        What the solid was made from; the new vertices lie on it within a fraction of a voxel.

    Raises
    ------
    MeshError, TopologyError
        See `trim.trim` and `carve.carve`.
    """
    frame = find_frame(original.vertices)
    planes = find_trim_planes(close_solid(solid, CLOSING[0]), frame, parameters)
    carving = _carve_open(solid, frame, planes, within(report, 0.0, 0.6))
    field = _depth(original, carving, frame, planes, within(report, 0.6, 1.0))
    surface = extract_surface(field, solid.origin, solid.pitch)
    filled = float(carving.filled.sum()) * solid.pitch**3
    return Torus(surface, frame, planes, solid.pitch, carving.handles, carving.membrane, filled)


def _carve_open(
    solid: VoxelSolid, frame: BrainFrame, planes: TrimPlanes, report: Report
) -> Carving:
    """Close cracks as far as leaves the oesophagus open, and carve.

    Raw surfaces have sheets inside the brain whose hollows reach the outside through cracks; such
    pockets are not anatomy and would flatten to nothing.
    """
    *wider, narrowest = CLOSING
    for radius in wider:
        with contextlib.suppress(TopologyError):
            return carve(trim(close_solid(solid, radius), frame, planes), frame, report)
    return carve(trim(close_solid(solid, narrowest), frame, planes), frame, report)


def _depth(
    original: SurfaceMesh,
    carving: Carving,
    frame: BrainFrame,
    planes: TrimPlanes,
    report: Report,
) -> Floats:
    """Return how deep each voxel near the surface lies inside, micrometres; negative outside.

    The sign is the label's, always; the size is the distance to the original surface or to a
    trim plane, so that the surface passes where the original does.
    """
    solid = carving.solid
    inside, structure = solid.inside, kuhn_structure()
    near = ndimage.binary_dilation(inside, structure) & ~ndimage.binary_erosion(inside, structure)
    index = np.nonzero(near)
    positions = solid.positions(index)
    to_surface = distances_to_surface(positions, original, report)
    depth_in_planes = plane_depth(positions, frame, planes)
    size = np.where(
        inside[index],
        np.minimum(to_surface, depth_in_planes),
        np.where(depth_in_planes > 0, to_surface, np.maximum(-depth_in_planes, 0)),
    )
    size[carving.filled[index]] = 0
    size = np.clip(size, SMALLEST_DEPTH * solid.pitch, None)
    field = np.where(inside, solid.pitch, -solid.pitch)
    field[index] = np.where(inside[index], size, -size)
    return np.asarray(field)
