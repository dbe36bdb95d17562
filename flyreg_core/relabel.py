"""Moving the border between two sides of a surface vertex by vertex, its topology unchanged.

The two sides are labels of vertices. A vertex may change side if the neighbours on either side
form one arc of its link: then neither side gains or loses a piece, a hole or a bridge.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np
from numba import njit

from flyreg_core.mesh import Booleans, Floats, Integers


@dataclass(frozen=True, eq=False)
class Links:
    """The link of each vertex of a closed mesh: the edges opposite to it in its faces."""

    start: Integers  # (n + 1,), where each vertex' edges begin
    edges: Integers  # (3 m, 2)


def find_links(faces: Integers, n_vertices: int) -> Links:
    """Return the links of a closed mesh."""
    corner = faces.T.reshape(-1)
    opposite = np.concatenate([faces[:, [1, 2]], faces[:, [2, 0]], faces[:, [0, 1]]])
    order = np.argsort(corner, kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(corner, minlength=n_vertices))])
    return Links(start.astype(np.int64), np.ascontiguousarray(opposite[order]))


def move_border(links: Links, side: Booleans, wanted: Floats) -> Booleans:
    """Return sides that agree with the signs of `wanted` as far as their topology allows.

    Parameters
    ----------
    side : (n,) bool
        The sides to start from, both of the topology that is to be kept.
    wanted : (n,) float
        Not negative where True is wanted; the largest values change side first.
    """
    moved = side.copy()
    _move_border(links.start, links.edges, moved, wanted >= 0, np.abs(wanted))
    return moved


def may_change(links: Links, side: Booleans, vertices: Integers) -> Booleans:
    """Tell which of the given vertices could change side without changing any topology."""
    return np.array(
        [_changes(links.start, links.edges, side, v) == 2 for v in vertices], dtype=bool
    )


def grow_patch(
    links: Links, patch: Integers, side: Booleans, wanted: Booleans, start: int, number: int
) -> Integers:
    """Return the patches with one more, grown from one vertex over the wanted ones around it.

    Parameters
    ----------
    patch : (n,) int
        0 where there is no patch yet.
    side : (n,) bool
        The patch remains a disk, and what is left of either side keeps its topology. Where the
        sides are rings, this makes their border cross the rim of the patch exactly twice: cut
        along it, the surface has the Euler characteristic of the rings only so.
    start : int
        A vertex on the border of the sides.
    """
    grown = patch.copy()
    grown[start] = number
    _grow_patch(links.start, links.edges, grown, side, wanted, start, number)
    return grown


@njit(nogil=True, cache=True)
def _changes(start: Integers, edges: Integers, chosen: Booleans, vertex: int) -> int:
    """Count how often being chosen changes once around a vertex; 2 means one arc of either."""
    count = 0
    for k in range(start[vertex], start[vertex + 1]):
        if chosen[edges[k, 0]] != chosen[edges[k, 1]]:
            count += 1
    return count


@njit(nogil=True, cache=True)
def _move_border(
    start: Integers, edges: Integers, side: Booleans, wanted: Booleans, urgency: Floats
) -> None:
    queue = [(0.0, -1)]
    for vertex in range(len(side)):
        if side[vertex] != wanted[vertex] and _changes(start, edges, side, vertex) == 2:
            queue.append((-urgency[vertex], vertex))
    heapq.heapify(queue)
    while queue:
        vertex = heapq.heappop(queue)[1]
        if vertex < 0 or side[vertex] == wanted[vertex]:
            continue
        if _changes(start, edges, side, vertex) != 2:
            continue
        side[vertex] = wanted[vertex]
        for k in range(start[vertex], start[vertex + 1]):
            near = edges[k, 0]
            if side[near] != wanted[near]:
                heapq.heappush(queue, (-urgency[near], near))


@njit(nogil=True, cache=True)
def _may_join(
    start: Integers, edges: Integers, patch: Integers, side: Booleans, number: int, vertex: int
) -> bool:
    whole, rest = 0, 0
    for k in range(start[vertex], start[vertex + 1]):
        a, b = edges[k]
        whole += (patch[a] == number) != (patch[b] == number)
        rest_a = patch[a] == 0 and side[a] == side[vertex]
        rest_b = patch[b] == 0 and side[b] == side[vertex]
        rest += rest_a != rest_b
    return whole == 2 and rest == 2


@njit(nogil=True, cache=True)
def _grow_patch(
    start: Integers,
    edges: Integers,
    patch: Integers,
    side: Booleans,
    wanted: Booleans,
    first: int,
    number: int,
) -> None:
    queue = [first]
    done = 0
    while done < len(queue):  # in the order found, so that the patch grows round, over either side
        vertex = queue[done]
        done += 1
        if vertex != first and (patch[vertex] != 0 or not wanted[vertex]):
            continue
        if vertex != first and not _may_join(start, edges, patch, side, number, vertex):
            continue
        patch[vertex] = number
        for k in range(start[vertex], start[vertex + 1]):
            near = edges[k, 0]
            if patch[near] == 0 and wanted[near]:
                queue.append(near)
