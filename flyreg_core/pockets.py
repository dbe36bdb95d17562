"""Stage 2d: pockets of a solid are filled below a depth, whatever they look like below it."""

from __future__ import annotations

import heapq
from dataclasses import replace

import numpy as np
from numba import njit
from scipy import ndimage

from flyreg_core.carve import carve
from flyreg_core.handles import Carving
from flyreg_core.mesh import Booleans, Floats, Integers
from flyreg_core.progress import Report, within
from flyreg_core.solid import VoxelSolid, close_cracks, kuhn_structure

WIDE = 2.0
"""A ball of this radius rolls around the solid, voxels; where it does not reach are pockets."""
DEPTH = 1.5
"""How deep pockets stay open, voxels: deep enough to show, shallower than the error allowed."""
AROUND_MEMBRANES = 2
"""How far around membranes nothing is taken away, voxels."""
STEPS = np.array([step for step in np.ndindex(3, 3, 3) if step != (1, 1, 1)], dtype=np.int64) - 1


def pocket_depths(inside: Booleans) -> Floats:
    """Return (nx, ny, nz) how far it is from the open to each voxel of a pocket, voxels.

    The way leads through the pocket. 0 in the open and inside, infinite in cavities. A chamber that
    the ball does not reach is a pocket, however wide it is.
    """
    margin = int(np.ceil(WIDE)) + 1
    solid = np.pad(inside, margin)
    reached = ~ndimage.binary_fill_holes(close_cracks(solid, WIDE), kuhn_structure())
    pockets = ~reached & ~solid
    structure = np.ones((3, 3, 3), dtype=bool)
    start = ndimage.binary_dilation(pockets, structure) & ~pockets & ~solid
    depth = _shortest_ways(
        *(pockets.reshape(-1), np.flatnonzero(start)),
        *(STEPS @ np.array(solid.strides, dtype=np.int64), np.linalg.norm(STEPS, axis=1)),
    ).reshape(solid.shape)
    depth[~pockets] = 0.0
    return np.asarray(depth[(slice(margin, -margin),) * 3])


@njit(nogil=True, cache=True)
def _shortest_ways(passable: Booleans, start: Integers, steps: Integers, lengths: Floats) -> Floats:
    away = np.full(len(passable), np.inf)
    queue = [(0.0, int(voxel)) for voxel in start]
    for voxel in start:
        away[voxel] = 0.0
    heapq.heapify(queue)
    while queue:
        so_far, voxel = heapq.heappop(queue)
        if so_far > away[voxel]:
            continue
        for k in range(len(steps)):
            near, further = voxel + steps[k], so_far + lengths[k]
            if passable[near] and further < away[near]:
                away[near] = further
                heapq.heappush(queue, (further, near))
    return away


def fill_pockets(
    carving: Carving,
    closed: VoxelSolid,
    solid: VoxelSolid,
    depths: Floats,
    is_main: Booleans,
    report: Report,
) -> VoxelSolid:
    """Return a carved solid with its pockets filled below `DEPTH` and open above it.

    Parameters
    ----------
    carving : Carving
        The solid carved to one handle, its cracks closed by a ball.
    closed : VoxelSolid
        That before carving, which added membranes.
    solid : VoxelSolid
        The same with its cracks open.
    depths : (nx, ny, nz) float
        Of the pockets of that, voxels, see `pocket_depths`.
    is_main : (nx, ny, nz) bool
        Where the main brain may be; nothing is added elsewhere.

    Notes
    -----
    Whether a ball fits decides about a whole pocket: a surface that is a little different would
    keep one that another has filled. Here such surfaces differ by no more than the depth that stays
    open. Voxels are added, the deepest first, and taken away, those nearest to the open first, only
    where that does not change the topology: the handle remains the one that was chosen. Nothing
    changes next to its membrane, from which turns around it are counted, and nothing is taken away
    next to the others: they would be left standing alone, with no thickness to cut.
    """
    is_deep = depths > DEPTH
    rim = ndimage.binary_dilation(carving.membrane, kuhn_structure())
    outside = ~carving.solid.inside
    places = is_deep & is_main & outside
    inside = ~_without(outside, places, depths, rim, within(report, 0.0, 0.5))
    held = ndimage.binary_dilation(
        carving.solid.inside & ~closed.inside,
        np.ones((3, 3, 3), dtype=bool),
        iterations=AROUND_MEMBRANES,
    )
    fixed = inside & (solid.inside | is_deep | rim | held)
    carve(inside, fixed, -depths, within(report, 0.5, 1.0))
    return replace(solid, inside=inside)


def _without(
    outside: Booleans, places: Booleans, depths: Floats, rim: Booleans, report: Report
) -> Booleans:
    """Return the outside without some places, the tunnel through them and its surroundings excepted.

    The tunnel's way is what is left of them in the middle when all that can go is gone. Pockets of
    the tunnel are as deep as it is from there to them; how wide the tunnel is does not count.
    """
    way = outside.copy()
    to_wall = ndimage.distance_transform_edt(outside)
    carve(way, outside & ~places, -to_wall, within(report, 0.0, 0.5))
    steps = STEPS @ np.array(outside.strides, dtype=np.int64)
    start = np.flatnonzero(places & (way | rim))
    away = _shortest_ways(places.reshape(-1), start, steps, np.linalg.norm(STEPS, axis=1))
    is_far = places & (away.reshape(places.shape) > WIDE + DEPTH)
    rest = outside.copy()
    carve(rest, outside & ~is_far, depths, within(report, 0.5, 1.0))
    return rest


def below_lids(filled: VoxelSolid, depths: Floats) -> Floats:
    """Return how far voxels at the floor of an open pocket lie below it, micrometres, 0 elsewhere.

    Negative above the floor; infinite depths count as little as `DEPTH` below it.
    """
    is_floor = ndimage.binary_dilation(filled.inside & (depths > DEPTH), kuhn_structure())
    below = np.clip(depths - DEPTH, -DEPTH, DEPTH)
    return np.asarray(np.where(is_floor & (depths > 0), filled.pitch * below, 0.0))
