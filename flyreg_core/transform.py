"""Carry points near one surface to the other, along the registration and back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from flyreg_core.mesh import Booleans, Floats, SurfaceMesh
from flyreg_core.surface_places import find_places
from flyreg_core.torus import ORIGINS, Torus

REACH_UM = 10.0
"""Points farther than this from the main brain's surface are not mapped unless the user says so."""


@dataclass(frozen=True, eq=False)
class TransformedPoints:
    """Where points went; rows of `points` that are not `is_mapped` are NaN."""

    points: Floats  # (n, 3), micrometres
    is_mapped: Booleans  # (n,)


def find_in_pockets(
    points: Floats, torus: Torus, raw: SurfaceMesh, reach_um: float = REACH_UM
) -> Booleans:
    """Return (n,) which points lie near the wall of a pocket that the prepared brain has filled.

    There the brain's own surface is deeper than the prepared one.

    Parameters
    ----------
    points : (n, 3) float
        In the frame of the brain, micrometres.
    torus, raw : Torus, SurfaceMesh
        The brain as prepared and as read.
    """
    nearest = cKDTree(torus.surface.vertices).query(points)[1]
    is_filled = torus.origin_of_vertex[nearest] == ORIGINS.index("filled")
    result = np.zeros(len(points), dtype=bool)
    pockets = np.flatnonzero(is_filled)
    result[pockets] = find_places(points[pockets], raw).apart_um <= reach_um
    return result


def transform_points(
    points: Floats,
    start: SurfaceMesh,
    end: SurfaceMesh,
    reach_um: float = REACH_UM,
    is_mirrored: bool = False,
    is_in_pocket: Booleans | None = None,
    to_end: Callable[[Floats], Floats] | None = None,
) -> TransformedPoints:
    """Return points carried from one surface to another one that has the same faces.

    Each point goes along with the nearest place of the surface and stays as far from it: in the
    direction in which a smooth map of space takes it, or without one along the normal.

    Parameters
    ----------
    points : (n, 3) float
        In the frame of `start`, micrometres.
    start, end : SurfaceMesh
        The prepared source and the registered surface, or the other way round.
    reach_um : float
        How far from `start` a point may lie to be mapped.
    is_mirrored : bool
        Whether the faces are seen from inside on one of the surfaces and from outside on the other.
    is_in_pocket : (n,) bool, optional
        Points that are mapped however far they lie from `start`, see `find_in_pockets`.
    to_end : function of (n, 3) float, optional
        A smooth map of space that takes the surroundings of `start` about to those of `end`.
    """
    places, faces = find_places(points, start), start.faces
    if to_end is None:
        normals = places.carried(start.vertex_normals, faces)
        outwards = np.sign(np.einsum("ij,ij->i", points - places.points, normals))
        sense = -outwards if is_mirrored else outwards
        direction = sense[:, None] * places.carried(end.vertex_normals, faces)
    else:
        direction = to_end(points) - to_end(places.points)
    length = np.linalg.norm(direction, axis=1, keepdims=True)
    direction = np.divide(direction, length, out=np.zeros_like(direction), where=length > 0)
    moved = places.carried(end.vertices, faces) + places.apart_um[:, None] * direction
    is_mapped = places.apart_um <= reach_um
    if is_in_pocket is not None:
        is_mapped |= is_in_pocket
    moved[~is_mapped] = np.nan
    return TransformedPoints(moved, is_mapped)
