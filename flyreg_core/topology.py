"""Connectivity of triangle meshes: edges, components, Euler characteristic, boundary loops."""

from __future__ import annotations

import numpy as np
from numba import njit

from flyreg_core.errors import TopologyError
from flyreg_core.mesh import Booleans, Integers


def half_edges(faces: Integers) -> Integers:
    """Return the (3m, 2) directed edges of the faces: all first edges, all second, all third."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def unique_edges(faces: Integers) -> tuple[Integers, Integers]:
    """Return each undirected edge once, lower vertex first, and in how many faces it lies."""
    n = int(faces.max(initial=-1)) + 1
    start, end = half_edges(faces).T
    low, high = np.minimum(start, end), np.maximum(start, end)
    keys, counts = np.unique(low * n + high, return_counts=True)
    return np.stack(np.divmod(keys, max(n, 1)), axis=1), counts.astype(np.int64)


def count_open_and_non_manifold_edges(faces: Integers) -> tuple[int, int]:
    """Return the numbers of edges with one face and of edges with more than two."""
    _, counts = unique_edges(faces)
    return int((counts == 1).sum()), int((counts > 2).sum())


def is_closed(faces: Integers) -> bool:
    """Tell whether each directed edge has exactly one opposite: watertight and consistently oriented."""
    n = int(faces.max(initial=-1)) + 1
    start, end = half_edges(faces).T
    forward, backward = np.sort(start * n + end), np.sort(end * n + start)
    return bool((forward[1:] > forward[:-1]).all()) and np.array_equal(forward, backward)


def euler_characteristic(faces: Integers) -> int:
    """Return V - E + F, counting only vertices that a face uses."""
    edges, _ = unique_edges(faces)
    return len(used_vertices(faces)) - len(edges) + len(faces)


def euler_characteristic_of(faces: Integers, chosen: Booleans) -> int:
    """Return V - E + F of the chosen vertices with all edges and faces between them."""
    edges, _ = unique_edges(faces)
    return int(chosen.sum() - chosen[edges].all(axis=1).sum() + chosen[faces].all(axis=1).sum())


def genus(faces: Integers) -> int:
    """Return the number of handles of a closed surface, summed over its components.

    Raises
    ------
    TopologyError
        The surface is not closed, so that it has no genus.
    """
    if not is_closed(faces):
        raise TopologyError("the surface is not closed, so its handles cannot be counted")
    components = len(np.unique(component_of_vertex(faces)[used_vertices(faces)]))
    return components - euler_characteristic(faces) // 2


def component_of_vertex(
    faces: Integers, n_vertices: int | None = None, chosen: Booleans | None = None
) -> Integers:
    """Return a component number for each vertex; edges count only between `chosen` vertices."""
    count = n_vertices if n_vertices is not None else int(faces.max(initial=-1)) + 1
    return _components(faces, np.ones(count, dtype=bool) if chosen is None else chosen)


@njit(nogil=True, cache=True)
def _components(faces: Integers, chosen: Booleans) -> Integers:
    """Return component numbers in the order of their first vertices (Tarjan's union and find)."""
    above = np.arange(len(chosen))
    for row in range(len(faces)):
        for corner in range(3):
            a, b = faces[row, corner], faces[row, (corner + 1) % 3]
            if not (chosen[a] and chosen[b]):
                continue
            while above[a] != a:
                above[a] = above[above[a]]
                a = above[a]
            while above[b] != b:
                above[b] = above[above[b]]
                b = above[b]
            above[max(a, b)] = min(a, b)
    component, count = np.zeros(len(chosen), dtype=np.int64), 0
    for vertex in range(len(chosen)):  # whose roots all have lower numbers
        if above[vertex] == vertex:
            component[vertex] = count
            count += 1
        else:
            component[vertex] = component[above[vertex]]
    return component


def boundary_loops(faces: Integers) -> list[Integers]:
    """Return the boundary loops, longest first, in the direction of the faces that lie on them.

    Seen from outside with the faces counter-clockwise, the surface lies to the left.

    Raises
    ------
    TopologyError
        Two loops touch in one vertex, so that they cannot be told apart.
    """
    directed = half_edges(faces)
    n = int(faces.max(initial=-1)) + 1
    key, opposite = directed[:, 0] * n + directed[:, 1], directed[:, 1] * n + directed[:, 0]
    on_boundary = directed[~is_among(opposite, np.sort(key))]
    following = dict(on_boundary.tolist())
    if len(following) != len(on_boundary):
        raise TopologyError("two boundary loops of the surface touch in one vertex")
    loops = []
    while following:
        start = min(following)
        loop = [start]
        while (vertex := following.pop(loop[-1])) != start:
            loop.append(vertex)
        loops.append(np.array(loop, dtype=np.int64))
    return sorted(loops, key=len, reverse=True)


def compacted(faces: Integers) -> tuple[Integers, Integers]:
    """Return the faces renumbered over the vertices they use, and those vertices' old numbers."""
    used = used_vertices(faces)
    number = np.zeros(int(faces.max(initial=-1)) + 1, dtype=np.int64)
    number[used] = np.arange(len(used))
    return number[faces], used


def used_vertices(faces: Integers) -> Integers:
    """Return the numbers of the vertices that faces use, growing."""
    is_used = np.zeros(int(faces.max(initial=-1)) + 1, dtype=bool)
    is_used[faces] = True
    return np.flatnonzero(is_used)


def is_among(keys: Integers, growing: Integers) -> Booleans:
    """Tell which keys are among others that do not fall."""
    if len(growing) == 0:
        return np.zeros(keys.shape, dtype=bool)
    place = np.minimum(np.searchsorted(growing, keys), len(growing) - 1)
    return np.asarray(growing[place] == keys)
