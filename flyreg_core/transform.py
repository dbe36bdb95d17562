"""Carry points near one surface to the other, along the registration and back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flyreg_core.errors import FlyregError
from flyreg_core.frame import LEFT_RIGHT
from flyreg_core.mesh import Booleans, Floats, SurfaceMesh
from flyreg_core.results import Results
from flyreg_core.surface_places import find_places
from flyreg_core.torus import Torus

REACH_UM = 10.0
"""Points farther than this from the main brain's surface are not mapped unless the user says so."""

SAMPLES = 2000
"""About how many vertices tell how far a surface departs from a map."""


@dataclass(frozen=True, eq=False)
class TransformedPoints:
    """Where points went; rows of `points` that are not `is_mapped` are NaN."""

    points: Floats  # (n, 3), micrometres
    is_mapped: Booleans  # (n,)


def check_reach(reach_um: float) -> None:
    """Tell whether a distance can be a reach.

    Raises
    ------
    FlyregError
        It is negative or not a number.
    """
    if not reach_um >= 0:
        raise FlyregError(
            f"the reach must be 0 or a positive number of micrometres, not {reach_um}"
        )


def carry(
    points: Floats, results: Results, reach_um: float = REACH_UM, is_inverse: bool = False
) -> TransformedPoints:
    """Return points carried along a registration, or back.

    Parameters
    ----------
    points : (n, 3) float
        In the frame of the source, of the target if `is_inverse`, micrometres.
    reach_um : float
        How far from the main brain's surface a point may lie to be mapped; infinite maps all.
    """
    start, end = results.source.surface, results.registration.surface
    brain, by_shape = results.source, results.to_target
    if is_inverse:
        start, end, brain = end, start, results.target
    to_end = None if by_shape is None else by_shape.back if is_inverse else by_shape
    is_mirrored = results.source.frame.is_mirrored != results.target.frame.is_mirrored
    is_all = np.isinf(reach_um)  # then it does not matter who lies in a pocket
    in_pocket = None if is_all else find_in_pockets(points, brain.torus, brain.raw, reach_um)
    return transform_points(points, start, end, reach_um, is_mirrored, in_pocket, to_end)


def find_in_pockets(
    points: Floats, torus: Torus, raw: SurfaceMesh, reach_um: float = REACH_UM
) -> Booleans:
    """Return (n,) which points lie near the brain's own surface where the prepared one may be far.

    That is in pockets and between sheets that the preparation has filled, between the trim planes.

    Parameters
    ----------
    points : (n, 3) float
        In the frame of the brain, micrometres.
    torus, raw : Torus, SurfaceMesh
        The brain as prepared and as read.
    """
    side = torus.frame.coordinates(points)[:, LEFT_RIGHT]
    result = (side > torus.planes.right) & (side < torus.planes.left)
    between = np.flatnonzero(result)
    result[between] = find_places(points[between], raw).apart_um <= reach_um
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

    Each point goes along with the nearest place of the surface. Off the surface it follows a smooth
    map of space, the more the farther off it lies: how the surface departs from that map counts no
    more where it is farther than it departs itself. Without a map it stays as far from the surface,
    along the normal.

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
    landed = places.carried(end.vertices, faces)
    if to_end is None:
        normals = places.carried(start.vertex_normals, faces)
        outwards = np.sign(np.einsum("ij,ij->i", points - places.points, normals))
        sense = -outwards if is_mirrored else outwards
        direction = sense[:, None] * places.carried(end.vertex_normals, faces)
        length = np.linalg.norm(direction, axis=1, keepdims=True)
        direction = np.divide(direction, length, out=np.zeros_like(direction), where=length > 0)
        moved = landed + places.apart_um[:, None] * direction
    else:
        departure = landed - to_end(places.points)
        share = 1 / (1 + (places.apart_um / _usual_departure(start, end, to_end)) ** 2)
        moved = to_end(points) + share[:, None] * departure
    is_mapped = places.apart_um <= reach_um
    if is_in_pocket is not None:
        is_mapped |= is_in_pocket
    moved[~is_mapped] = np.nan
    return TransformedPoints(moved, is_mapped)


def _usual_departure(
    start: SurfaceMesh, end: SurfaceMesh, to_end: Callable[[Floats], Floats]
) -> float:
    """Return the root mean square distance from where a map takes a surface to where it went.

    Vertices count as much as the area around them, as they are more where there is more detail.
    """
    step = max(len(start.vertices) // SAMPLES, 1)
    away = end.vertices[::step] - to_end(start.vertices[::step])
    areas = start.vertex_areas[::step]
    weights = areas / max(areas.sum(), np.finfo(float).tiny)
    mean_square = float(weights @ (away**2).sum(axis=1))
    return max(float(np.sqrt(mean_square)), np.finfo(float).tiny)
