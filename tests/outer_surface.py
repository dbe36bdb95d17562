"""How far the outsides of two surfaces are apart, whatever sheets and hollows lie inside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from flyreg_core.mesh import SurfaceMesh
from flyreg_core.progress import ignore
from flyreg_core.surface_distance import distances_to_surface, sample_surface
from flyreg_core.topology import component_of_vertex

BALL = 6.0
"""Radius of the ball that rolls around a surface and touches what is its outside, micrometres."""
PITCH = 2.5
SAMPLES = 100_000


def outer_distances(a: SurfaceMesh, b: SurfaceMesh) -> NDArray[np.float64]:
    """Return distances of points on the outside of each of two surfaces to the other, both ways."""
    return np.concatenate(
        [
            distances_to_surface(_outer_points(one)[::3], other, ignore)
            for one, other in ((a, b), (b, a))
        ]
    )


def largest_part(surface: SurfaceMesh) -> SurfaceMesh:
    """Return the component of most faces: raw templates have crumbs beside them."""
    component = component_of_vertex(surface.faces, len(surface.vertices))[surface.faces[:, 0]]
    return SurfaceMesh(
        surface.vertices, surface.faces[component == np.bincount(component).argmax()]
    )


def _outer_points(surface: SurfaceMesh) -> NDArray[np.float64]:
    points = sample_surface(surface, SAMPLES)
    low = points.min(axis=0) - 2 * BALL
    voxel = np.round((points - low) / PITCH).astype(int)
    is_free = np.ones(voxel.max(axis=0) + 6, dtype=bool)
    is_free[tuple(voxel.T)] = False
    regions, _ = ndimage.label(ndimage.distance_transform_edt(is_free) * PITCH > BALL)
    away = ndimage.distance_transform_edt(regions != regions[0, 0, 0]) * PITCH
    return points[away[tuple(voxel.T)] < BALL + PITCH]
