"""Stage 2b: a solid with exactly one handle, whatever handles the data pretend to.

On the Kuhn grid each voxel has 14 neighbours, which form a triangulated sphere (its link), and
a surface drawn between inside and outside voxels by marching tetrahedra has exactly the topology
of the labels. Carving starts from a block, a ball, and takes away voxels outside the solid whose
removal cannot change the topology; what remains is still a ball and contains the solid, so each
tunnel through the solid is closed by a thin membrane. Piercing one membrane opens one handle.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from functools import cache

import numpy as np
from numba import njit
from scipy import ndimage

from flyreg_core.errors import TopologyError
from flyreg_core.frame import BrainFrame
from flyreg_core.mesh import Booleans, Floats, Integers
from flyreg_core.progress import Report
from flyreg_core.solid import KUHN_OFFSETS, VoxelSolid, kuhn_structure

NEIGHBOURS = np.vstack([KUHN_OFFSETS, -KUHN_OFFSETS])
"""(14, 3) steps to the neighbours of a voxel; bit k of a link stands for row k."""
STEPS_PER_REPORT = 100_000
MIDLINE_SHARE = 0.1
"""How far from the midline the oesophagus may lie, as a share of the main brain's width."""


@dataclass(frozen=True)
class Handle:
    """A tunnel through the solid, closed by a membrane at its narrowest place."""

    center_um: tuple[float, float, float]
    width_um: float
    is_near_midline: bool
    is_oesophagus: bool


@dataclass(frozen=True, eq=False)
class Carving:
    """A solid with one handle, and what it took to get there."""

    solid: VoxelSolid
    handles: tuple[Handle, ...]  # widest first
    filled: Booleans  # voxels that the original solid does not have
    membrane: Floats  # (k, 3), voxels that closed the oesophagus, micrometres

    @property
    def oesophagus(self) -> Handle:
        """The handle that was opened."""
        return next(handle for handle in self.handles if handle.is_oesophagus)


@cache
def _components_of_link() -> tuple[Integers, Integers]:
    """Return for each of the 2^14 links how many pieces its inside and its outside have."""
    differences = NEIGHBOURS[:, None] - NEIGHBOURS[None]
    is_step = (differences[:, :, None] == NEIGHBOURS[None, None]).all(axis=3).any(axis=2)
    adjacent = (is_step * (1 << np.arange(14))).sum(axis=1)
    pieces = _count_pieces(adjacent.astype(np.int64))
    return pieces, pieces[::-1].copy()


@njit(nogil=True, cache=True)
def _count_pieces(adjacent: Integers) -> Integers:
    pieces = np.zeros(1 << 14, dtype=np.int64)
    for link in range(1 << 14):
        rest = link
        while rest:
            pieces[link] += 1
            piece = rest & -rest
            grown = True
            while grown:
                wider = piece
                for k in range(14):
                    if piece >> k & 1:
                        wider |= adjacent[k] & rest
                grown = wider != piece
                piece = wider
            rest &= ~piece
    return pieces


@njit(nogil=True, cache=True)
def _link(inside: Booleans, voxel: int, steps: Integers) -> int:
    link = 0
    for k in range(14):
        if inside[voxel + steps[k]]:
            link |= 1 << k
    return link


@njit(nogil=True, cache=True)
def _carve(
    inside: Booleans,
    fixed: Booleans,
    distance: Floats,
    steps: Integers,
    is_simple: Booleans,
    limit: int,
) -> bool:
    """Remove up to `limit` simple voxels, farthest from the solid first; tell if any may be left."""
    queued = np.zeros(len(inside), dtype=np.bool_)
    queue = [(0.0, 0)]
    for voxel in range(len(inside)):
        if inside[voxel] and not fixed[voxel] and _link(inside, voxel, steps) != (1 << 14) - 1:
            queued[voxel] = True
            queue.append((-distance[voxel], voxel))
    queue.pop(0)
    heapq.heapify(queue)
    removed = 0
    while queue and removed < limit:
        voxel = heapq.heappop(queue)[1]
        queued[voxel] = False
        if not is_simple[_link(inside, voxel, steps)]:
            continue
        inside[voxel] = False
        removed += 1
        for k in range(14):
            neighbour = voxel + steps[k]
            if inside[neighbour] and not fixed[neighbour] and not queued[neighbour]:
                queued[neighbour] = True
                heapq.heappush(queue, (-distance[neighbour], neighbour))
    return removed == limit


def carve(solid: VoxelSolid, frame: BrainFrame, report: Report) -> Carving:
    """Return the smallest solid around the given one that has exactly one handle, the oesophagus.

    Parameters
    ----------
    solid : VoxelSolid
        One component without cavities.
    frame : BrainFrame
        Tells where the midline is.

    Raises
    ------
    TopologyError
        No tunnel passes near the midline.

    Notes
    -----
    Only adds voxels, thin membranes across the other tunnels. The oesophagus is the widest tunnel
    within a tenth of the main brain's width of its midline.

    References
    ----------
    Simple points: Kong and Rosenfeld, Digital topology, CVGIP 48, 1989,
    doi:10.1016/0734-189X(89)90147-3. The 14-neighbourhood: Freudenthal's triangulation (Kuhn 1960).
    """
    low = np.array([np.flatnonzero(solid.inside.any(axis=_others(a)))[0] for a in range(3)]) - 2
    high = np.array([np.flatnonzero(solid.inside.any(axis=_others(a)))[-1] for a in range(3)]) + 3
    box = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
    fixed = solid.inside[box]
    distance = ndimage.distance_transform_edt(~fixed)
    inside = np.zeros_like(fixed)
    inside[1:-1, 1:-1, 1:-1] = True
    _carve_to_the_end(inside, fixed, distance, report)
    membranes, tunnels = _find_membranes(inside, fixed, distance, frame)
    if not tunnels:
        raise TopologyError(
            f"no tunnel through the main brain passes within {MIDLINE_SHARE:.0%} of its midline, so "
            "the oesophagus cannot be told; check the trim planes and the resolution"
        )
    oesophagus = max(tunnels, key=lambda tunnel: (distance[tunnel], tunnel))
    labels, _ = ndimage.label(inside & ~fixed, kuhn_structure())
    membrane = np.argwhere(labels == labels[oesophagus]) + low
    inside[oesophagus] = False
    _carve_to_the_end(inside, fixed, distance, report)
    handles = tuple(
        Handle(
            center_um=_as_tuple(solid.positions(tuple(low + np.array(voxel)))),
            width_um=float(2 * solid.pitch * distance[voxel]),
            is_near_midline=voxel in tunnels,
            is_oesophagus=voxel == oesophagus,
        )
        for voxel in sorted(membranes, key=lambda voxel: (-distance[voxel], voxel))
    )
    carved, filled = np.zeros_like(solid.inside), np.zeros_like(solid.inside)
    carved[box], filled[box] = inside, inside & ~fixed
    return Carving(
        VoxelSolid(carved, solid.origin, solid.pitch),
        handles,
        filled,
        solid.positions(tuple(membrane.T)),
    )


def _others(axis: int) -> tuple[int, ...]:
    return tuple(other for other in range(3) if other != axis)


def _as_tuple(point: Floats) -> tuple[float, float, float]:
    return float(point[0]), float(point[1]), float(point[2])


def _carve_to_the_end(inside: Booleans, fixed: Booleans, distance: Floats, report: Report) -> None:
    inside_pieces, outside_pieces = _components_of_link()
    is_simple = (inside_pieces == 1) & (outside_pieces == 1)
    strides = np.array(inside.strides, dtype=np.int64)
    steps = NEIGHBOURS @ strides
    first = max(1, int(inside.sum()) - int(fixed.sum()))
    while True:
        left = max(0, int(inside.sum()) - int(fixed.sum()))
        report(1 - left / first, "carving the outside away")
        if not _carve(
            inside.reshape(-1),
            fixed.reshape(-1),
            distance.reshape(-1),
            steps,
            is_simple,
            STEPS_PER_REPORT,
        ):
            return


def _find_membranes(
    inside: Booleans, fixed: Booleans, distance: Floats, frame: BrainFrame
) -> tuple[list[tuple[int, ...]], list[tuple[int, ...]]]:
    """Return the voxel to pierce of each membrane, and those of them near the midline.

    Piercing opens exactly one tunnel where the link's inside is one ring: one piece, between two
    pieces of outside.
    """
    inside_pieces, outside_pieces = _components_of_link()
    is_ring = (inside_pieces == 1) & (outside_pieces == 2)
    steps = NEIGHBOURS @ np.array(inside.strides, dtype=np.int64)
    labels, count = ndimage.label(inside & ~fixed, kuhn_structure())
    flat = np.flatnonzero(labels)
    pierceable = np.array([is_ring[_link(inside.reshape(-1), int(voxel), steps)] for voxel in flat])
    widest: dict[int, int] = {}
    for voxel in flat[pierceable] if count else ():
        membrane = int(labels.flat[voxel])
        if membrane not in widest or distance.flat[voxel] > distance.flat[widest[membrane]]:
            widest[membrane] = int(voxel)
    voxels = [tuple(int(i) for i in np.unravel_index(v, inside.shape)) for v in widest.values()]
    across = np.nonzero(fixed)[frame.left_right]
    middle, width = (across.min() + across.max()) / 2, np.ptp(across)
    near = [v for v in voxels if abs(v[frame.left_right] - middle) <= MIDLINE_SHARE * width]
    return voxels, near
