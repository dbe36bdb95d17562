"""Connectivity of triangle meshes: edges, components, Euler characteristic, boundary loops."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from flyreg_core.errors import TopologyError
from flyreg_core.mesh import Booleans, Integers


def half_edges(faces: Integers) -> Integers:
    """Return the (3m, 2) directed edges of the faces: all first edges, all second, all third."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def unique_edges(faces: Integers) -> tuple[Integers, Integers]:
    """Return each undirected edge once, lower vertex first, and in how many faces it lies."""
    n = int(faces.max(initial=-1)) + 1
    low, high = np.sort(half_edges(faces), axis=1).T
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
    forward, backward = np.unique(start * n + end), np.unique(end * n + start)
    return len(forward) == len(start) and np.array_equal(forward, backward)


def euler_characteristic(faces: Integers) -> int:
    """Return V - E + F, counting only vertices that a face uses."""
    edges, _ = unique_edges(faces)
    return len(np.unique(faces)) - len(edges) + len(faces)


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
    components = len(np.unique(component_of_vertex(faces)[np.unique(faces)]))
    return components - euler_characteristic(faces) // 2


def component_of_vertex(
    faces: Integers, n_vertices: int | None = None, chosen: Booleans | None = None
) -> Integers:
    """Return a component number for each vertex; edges count only between `chosen` vertices."""
    count = n_vertices if n_vertices is not None else int(faces.max(initial=-1)) + 1
    edges = half_edges(faces)
    if chosen is not None:
        edges = edges[chosen[edges].all(axis=1)]
    graph = sparse.coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (count, count))
    return connected_components(graph, directed=False)[1].astype(np.int64)


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
    on_boundary = directed[~np.isin(key, opposite)]
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
    used, renumbered = np.unique(faces, return_inverse=True)
    return renumbered.reshape(-1, 3).astype(np.int64), used.astype(np.int64)
