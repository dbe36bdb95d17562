"""Stage 2d: pockets of a solid are filled below a depth, whatever they look like below it."""

from __future__ import annotations

import heapq
from dataclasses import replace

import numpy as np
import scipy
from numba import njit

from flyreg_core.carve import carve
from flyreg_core.handles import Carving
from flyreg_core.mesh import Booleans, Floats, Integers
from flyreg_core.progress import Report, within
from flyreg_core.solid import VoxelSolid, kuhn_structure

NARROW, WIDE = 1.0, 4.0
"""Radii of balls, voxels: a way counts in full where no larger one than the first fits, and less the
larger it is, down to nothing where the second does."""
DEPTH = 1.0
"""How deep pockets stay open: deep enough to show, shallower than the error allowed."""
FARTHEST_FROM_WAY = 5.0
"""How far a deep part of a tunnel may be from its way and stay open, voxels."""
SHALLOW_BEFORE_MIDDLE = 2.0
"""How much more the way of a tunnel keeps to the shallow than to the middle."""
AROUND_MEMBRANES = 2
"""How far around membranes nothing is taken away, voxels."""
STEPS = np.array([step for step in np.ndindex(3, 3, 3) if step != (1, 1, 1)], dtype=np.int64) - 1


def pocket_depths(inside: Booleans) -> Floats:
    """Return (nx, ny, nz) how deep below the open each voxel of a pocket lies, voxels.

    The way leads through the pocket, and each step of it counts by how narrow the pocket is there:
    what is a little narrower is a little deeper, and a wide chamber behind a narrow mouth is deep.
    0 in the open and inside, infinite in cavities.
    """
    margin = int(np.ceil(WIDE)) + 1
    outside = ~np.pad(inside, margin)
    narrowness = np.clip((WIDE - local_thickness(outside, WIDE)) / (WIDE - NARROW), 0.0, 1.0)
    is_open = _with_the_corner(outside & (narrowness == 0))
    pockets = outside & ~is_open
    start = scipy.ndimage.binary_dilation(pockets, np.ones((3, 3, 3), dtype=bool)) & is_open
    depth = _shortest_ways(pockets, narrowness, start)
    depth[~pockets] = 0.0
    return np.asarray(depth[(slice(margin, -margin),) * 3])


def local_thickness(outside: Booleans, most: float) -> Floats:
    """Return the radius of the largest ball that covers each voxel and touches no other, voxels.

    Parameters
    ----------
    outside : (nx, ny, nz) bool
        What the balls lie in.
    most : float
        Where a ball of this radius fits, no larger one is looked for.

    References
    ----------
    Hildebrand, Ruegsegger, A new method for the model-independent assessment of thickness in
    three-dimensional images, J. Microscopy 185(1), 1997, doi:10.1046/j.1365-2818.1997.1340694.x.
    """
    radius = scipy.ndimage.distance_transform_edt(outside)
    is_wide = radius >= most
    thickness = np.where(scipy.ndimage.distance_transform_edt(~is_wide) < most, most, 0.0)
    _cover(thickness, np.where(is_wide, 0.0, radius))
    return np.where(outside, thickness, 0.0)


@njit(nogil=True, cache=True)
def _cover(thickness: Floats, radius: Floats) -> None:
    width, height, depth = radius.shape
    for i, j, k in np.argwhere(radius > 0):
        own = radius[i, j, k]
        squared, reach = round(own * own), int(own)
        for x in range(max(0, i - reach), min(width, i + reach + 1)):
            for y in range(max(0, j - reach), min(height, j + reach + 1)):
                for z in range(max(0, k - reach), min(depth, k + reach + 1)):
                    away = (x - i) ** 2 + (y - j) ** 2 + (z - k) ** 2
                    if away < squared and thickness[x, y, z] < own:
                        thickness[x, y, z] = own


def _with_the_corner(outside: Booleans) -> Booleans:
    """Return the component of the outside that holds its first corner."""
    labels, _ = scipy.ndimage.label(outside, kuhn_structure())
    return np.asarray(labels == labels[0, 0, 0])


def _shortest_ways(passable: Booleans, costs: Floats, start: Booleans) -> Floats:
    """Return (nx, ny, nz) the least cost of a way from any start, voxels times costs on the way.

    Infinite where no way leads; the outermost layer is not passable.
    """
    steps = STEPS @ np.array(passable.strides, dtype=np.int64)
    lengths, places = np.linalg.norm(STEPS, axis=1), np.flatnonzero(start)
    ways = _shortest_flat_ways(passable.reshape(-1), costs.reshape(-1), places, steps, lengths)
    return np.asarray(ways.reshape(passable.shape))


@njit(nogil=True, cache=True)
def _shortest_flat_ways(
    passable: Booleans, costs: Floats, start: Integers, steps: Integers, lengths: Floats
) -> Floats:
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
            near = voxel + steps[k]
            if not passable[near]:
                continue
            further = so_far + lengths[k] * (costs[voxel] + costs[near]) / 2
            if further < away[near]:
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
    Were one ball to decide by whether it fits about a whole pocket, a surface that is a little
    different would keep one that another has filled. Here such surfaces differ by no more than the
    depth that stays open. Voxels are added, the deepest first, and taken away, those nearest to the
    open first, only where that does not change the topology: the handle remains the one that was
    chosen. Nothing changes next to its membrane, from which turns around it are counted, and nothing
    is taken away next to the others: they would be left standing alone, with no thickness to cut.
    """
    is_deep = depths > DEPTH
    rim = scipy.ndimage.binary_dilation(carving.membrane, kuhn_structure())
    outside = ~carving.solid.inside
    places = is_deep & is_main & outside
    inside = ~_without(outside, places, depths, rim, within(report, 0.0, 0.5))
    held = scipy.ndimage.binary_dilation(
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

    The tunnel's way is what is left of pockets when all that can go is gone, the deepest and nearest
    to the wall first. Pockets of the tunnel are as deep as it is from there to them; how wide the
    tunnel is does not count, nor where a membrane spans it. What is cut off from the open by the
    places is one of them.
    """
    pockets, places = (
        outside & ~_with_the_corner(outside & ~part) for part in (depths > 0, places)
    )
    way = outside.copy()
    finite = np.where(np.isinf(depths), outside.size, depths)
    last = SHALLOW_BEFORE_MIDDLE * finite - scipy.ndimage.distance_transform_edt(outside)
    carve(way, outside & ~pockets, last, within(report, 0.0, 0.5))
    away = _shortest_ways(pockets, np.ones(outside.shape), pockets & way)
    is_far = places & (away > FARTHEST_FROM_WAY)
    rest = outside.copy()
    carve(rest, outside & (rim | ~is_far), depths, within(report, 0.5, 1.0))
    return rest


def below_lids(filled: VoxelSolid, depths: Floats) -> Floats:
    """Return how far voxels at the floor of an open pocket lie below it, micrometres, 0 elsewhere.

    Negative above the floor; infinite depths count as little as `DEPTH` below it.
    """
    is_floor = scipy.ndimage.binary_dilation(filled.inside & (depths > DEPTH), kuhn_structure())
    below = np.clip(depths - DEPTH, -DEPTH, DEPTH)
    return np.asarray(np.where(is_floor & (depths > 0), filled.pitch * below, 0.0))
