"""Stage 2b: taking voxels away without changing the topology.

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
import scipy
from numba import njit

from flyreg_core.mesh import Booleans, Floats, Integers
from flyreg_core.progress import Report
from flyreg_core.solid import KUHN_OFFSETS, kuhn_structure

NEIGHBOURS = np.vstack([KUHN_OFFSETS, -KUHN_OFFSETS])
"""(14, 3) steps to the neighbours of a voxel; bit k of a link stands for row k."""
STEPS_PER_REPORT = 100_000


@dataclass(frozen=True, eq=False)
class Membrane:
    """A sheet that closes one or more tunnels, and the voxel to pierce in it."""

    voxel: tuple[int, int, int]  # the farthest from the solid among those that open one tunnel
    width: float  # of the tunnel there, voxels
    direction: Floats  # (3,) unit vector along which the tunnel runs, its sign without meaning


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


def carve(inside: Booleans, fixed: Booleans, distance: Floats, report: Report) -> None:
    """Take away, in place, all that can go without changing the topology, farthest first.

    Parameters
    ----------
    inside : (nx, ny, nz) bool
        What is carved; its outermost layer is outside.
    fixed : (nx, ny, nz) bool
        What must stay.
    distance : (nx, ny, nz) float
        How far each voxel is from what must stay.

    References
    ----------
    Simple points: Kong and Rosenfeld, Digital topology, CVGIP 48, 1989,
    doi:10.1016/0734-189X(89)90147-3. The 14-neighbourhood: Freudenthal's triangulation (Kuhn 1960).
    """
    inside_pieces, outside_pieces = _components_of_link()
    is_simple = (inside_pieces == 1) & (outside_pieces == 1)
    steps = NEIGHBOURS @ np.array(inside.strides, dtype=np.int64)
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


def find_membranes(inside: Booleans, fixed: Booleans, distance: Floats) -> list[Membrane]:
    """Return the membranes of a carved solid that can be pierced, the widest first.

    Piercing a voxel opens exactly one tunnel where the link's inside is one ring: one piece,
    between two pieces of outside.
    """
    inside_pieces, outside_pieces = _components_of_link()
    is_ring = (inside_pieces == 1) & (outside_pieces == 2)
    flat_inside = inside.reshape(-1)
    steps = NEIGHBOURS @ np.array(inside.strides, dtype=np.int64)
    labels, _ = scipy.ndimage.label(inside & ~fixed, kuhn_structure())
    voxels = np.flatnonzero(labels)
    links = np.array([_link(flat_inside, int(voxel), steps) for voxel in voxels], dtype=np.int64)
    is_pierceable = is_ring[links] if len(links) else np.zeros(0, dtype=bool)
    voxels, links = voxels[is_pierceable], links[is_pierceable]
    sheet, away = labels.flat[voxels], distance.flat[voxels]
    membranes = []
    for number in np.unique(sheet):
        own = np.flatnonzero(sheet == number)
        best = own[np.argmax(away[own])]
        near = own[away[own] >= away[best] / 2]
        i, j, k = (int(n) for n in np.unravel_index(voxels[best], inside.shape))
        direction = _direction(links[near])
        membranes.append(Membrane((i, j, k), float(2 * away[best]), direction))
    return sorted(membranes, key=lambda membrane: (-membrane.width, membrane.voxel))


def _direction(links: Integers) -> Floats:
    """Return the direction from one side to the other, as most of the voxels of a sheet see it.

    Each sees the gradient of the linear function that fits 1 on one side, 0 in the sheet and -1 on
    the other best; a mere mean of neighbours would lean towards the diagonal of the Kuhn grid.
    """
    moments = NEIGHBOURS.T @ NEIGHBOURS
    arms = []
    for link in links:
        front, back = (NEIGHBOURS[list(bits)].sum(axis=0) for bits in pieces_of_outside(int(link)))
        arms.append(np.linalg.solve(moments, front - back))
    return np.asarray(np.linalg.svd(np.array(arms))[2][0])


def pieces_of_outside(link: int) -> list[set[int]]:
    """Return the connected pieces of a link's outside, each as a set of rows of `NEIGHBOURS`."""
    rest = {k for k in range(14) if not link >> k & 1}
    pieces = []
    while rest:
        piece, grown = {min(rest)}, {min(rest)}
        while grown:
            grown = {k for k in rest - piece if any(_is_step(k, other) for other in piece)}
            piece |= grown
        rest -= piece
        pieces.append(piece)
    return pieces


def _is_step(one: int, other: int) -> bool:
    difference = NEIGHBOURS[one] - NEIGHBOURS[other]
    return bool((difference == NEIGHBOURS).all(axis=1).any())


@njit(nogil=True, cache=True)
def _steps_from(passable: Booleans, start: Integers, steps: Integers) -> Integers:
    away = np.full(len(passable), -1, dtype=np.int64)
    queue = np.zeros(len(passable), dtype=np.int64)
    filled = 0
    for voxel in start:
        if passable[voxel] and away[voxel] < 0:
            away[voxel] = 0
            queue[filled] = voxel
            filled += 1
    done = 0
    while done < filled:
        voxel = queue[done]
        done += 1
        for k in range(14):
            near = voxel + steps[k]
            if passable[near] and away[near] < 0:
                away[near] = away[voxel] + 1
                queue[filled] = near
                filled += 1
    return away


def steps_through(outside: Booleans, start: Booleans) -> Integers:
    """Return (nx, ny, nz) the fewest steps through the outside from any start; -1 out of reach.

    The outermost layer is never entered.
    """
    passable = np.zeros_like(outside)
    passable[1:-1, 1:-1, 1:-1] = outside[1:-1, 1:-1, 1:-1]
    steps = NEIGHBOURS @ np.array(passable.strides, dtype=np.int64)
    away = _steps_from(passable.reshape(-1), np.flatnonzero(start), steps)
    return away.reshape(outside.shape)


def link_of(inside: Booleans, voxel: tuple[int, int, int]) -> int:
    """Return the link of one voxel: bit k tells whether its neighbour `NEIGHBOURS[k]` is inside."""
    steps = NEIGHBOURS @ np.array(inside.strides, dtype=np.int64)
    return int(_link(inside.reshape(-1), int(np.ravel_multi_index(voxel, inside.shape)), steps))
