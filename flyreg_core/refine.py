"""Refining a triangle mesh along lines on it, without changing the surface it describes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flyreg_core.mesh import Booleans, Floats, Integers
from flyreg_core.topology import component_of_vertex, unique_edges

CLOSEST_TO_END = 0.05
"""A new vertex keeps this share of its edge to either end, so that no face loses its area."""


@dataclass(frozen=True, eq=False)
class AddedVertices:
    """The last vertices of a mesh, each on an edge between others before it, whole till then."""

    ends: Integers  # (k, 2), the edge, lower vertex first
    share: Floats  # (k,), how far along it

    def __len__(self) -> int:
        return len(self.share)

    def joined(self, others: AddedVertices) -> AddedVertices:
        """Return these, and after them others."""
        return AddedVertices(
            np.concatenate([self.ends, others.ends]), np.concatenate([self.share, others.share])
        )

    def stiffening(self, number: Integers, neighbours: Integers, across: float) -> Floats:
        """Return how many times as strong springs from added vertices are as those they divide.

        As springs are, the parts of an edge are the stronger the shorter they are.

        Parameters
        ----------
        number, neighbours : (n,) int
            Which added vertex each spring starts from, and the vertex where it ends.
        across : float
            What is returned for springs that are no part of the edge.
        """
        ends, share = self.ends[number], self.share[number]
        rest = np.where(ends[:, 1] == neighbours, 1 / (1 - share), across)
        return np.asarray(np.where(ends[:, 0] == neighbours, 1 / share, rest))


def no_vertices() -> AddedVertices:
    """Return none."""
    return AddedVertices(np.zeros((0, 2), dtype=np.int64), np.zeros(0))


@dataclass(frozen=True, eq=False)
class Refinement:
    """A refined mesh: old vertices first, then one new vertex on each split edge."""

    faces: Integers  # (m', 3)
    parent: Integers  # (m',), the old face each new face is part of
    added: AddedVertices

    def sides(self, values: Floats) -> Booleans:
        """Return for each face whether the old vertices it has are positive (0 counts so)."""
        is_old = self.faces < len(values)
        first_old = self.faces[np.arange(len(self.faces)), is_old.argmax(axis=1)]
        return np.asarray(values[first_old] >= 0)

    def carry(self, values: Floats) -> Floats:
        """Return values given at the old vertices at all vertices, linear along edges."""
        share = self.added.share.reshape(-1, *[1] * (values.ndim - 1))
        first, second = (values[ends] for ends in self.added.ends.T)
        new = (1 - share) * first + share * second
        return np.concatenate([values, new])


def split_along_zero(faces: Integers, values: Floats) -> Refinement:
    """Split each edge where values at its ends differ in sign; the line of zeros becomes edges.

    A value of exactly 0 counts as positive. As the line is drawn between vertices of different
    sign, it consists of simple closed curves whatever the values are (on a closed mesh).
    """
    positive = values >= 0
    edges, _ = unique_edges(faces)
    split = edges[positive[edges[:, 0]] != positive[edges[:, 1]]]
    size = np.abs(values[split])
    total = size.sum(axis=1)
    share = np.divide(size[:, 0], total, out=np.full(len(split), 0.5), where=total > 0)
    return _split(faces, split, np.clip(share, CLOSEST_TO_END, 1 - CLOSEST_TO_END))


def split_edges(faces: Integers, edges: Integers, share: Floats | float = 0.5) -> Refinement:
    """Split the given edges, in the middle if not said otherwise.

    Parameters
    ----------
    edges : (k, 2) int
        Edges of the mesh, lower vertex first; no face may have all three sides among them.
    share : (k,) float, or one for all
        How far along each edge.
    """
    return _split(faces, edges, np.broadcast_to(share, len(edges)))


def _split(faces: Integers, edges: Integers, share: Floats) -> Refinement:
    n = int(faces.max()) + 1
    key = edges[:, 0] * n + edges[:, 1]
    order = np.argsort(key)
    key, edges, share = key[order], edges[order], share[order]
    near = faces_with_an_edge_among(faces, edges)
    number = edges_at_sides(faces[near], edges, n)
    is_split = number >= 0
    new_vertex = np.where(is_split, n + number, -1)
    count_split = is_split.sum(axis=1)
    is_whole = np.ones(len(faces), dtype=bool)
    is_whole[near[count_split > 0]] = False
    whole = np.flatnonzero(is_whole)
    pieces, parents = [faces[whole]], [whole]
    for count, divide in ((1, _halves), (2, _corner_and_rest)):
        chosen = np.flatnonzero(count_split == count)
        for part in divide(faces[near[chosen]], new_vertex[chosen]):
            pieces.append(part)
            parents.append(near[chosen])
    return Refinement(np.concatenate(pieces), np.concatenate(parents), AddedVertices(edges, share))


def faces_with_an_edge_among(faces: Integers, edges: Integers) -> Integers:
    """Return the faces that may have one of the edges: at least two of their vertices end edges."""
    is_end = np.zeros(int(faces.max()) + 1, dtype=bool)
    is_end[edges] = True
    first, second, third = is_end[faces].T
    return np.flatnonzero((first & second) | (second & third) | (third & first))


def edges_at_sides(faces: Integers, edges: Integers, n_vertices: int) -> Integers:
    """Return (m, 3) which of (k, 2) edges each side of the faces is; -1 where it is none of them."""
    if not len(edges):
        return np.full(faces.shape, -1)
    keys, sides = edges @ [n_vertices, 1], side_keys(faces, n_vertices)
    order = np.argsort(keys)
    number = order[np.minimum(np.searchsorted(keys, sides, sorter=order), len(keys) - 1)]
    return np.where(keys[number] == sides, number, -1)


def side_keys(faces: Integers, n_vertices: int) -> Integers:
    """Return (m, 3) the keys of each face's sides: lower vertex times `n_vertices` plus the other."""
    following = np.roll(faces, -1, axis=1)
    return np.minimum(faces, following) * n_vertices + np.maximum(faces, following)


def _halves(faces: Integers, new_vertex: Integers) -> list[Integers]:
    """Split faces with one split edge, turned so that this edge comes first."""
    first = new_vertex.argmax(axis=1) if len(faces) else np.zeros(0, dtype=np.int64)
    a, b, c = (_turned(faces, first, k) for k in range(3))
    p = new_vertex.max(axis=1, initial=-1)
    return [np.stack([a, p, c], axis=1), np.stack([p, b, c], axis=1)]


def _corner_and_rest(faces: Integers, new_vertex: Integers) -> list[Integers]:
    """Split faces with two split edges: the corner between them, and the quadrilateral left."""
    lone = (new_vertex.argmin(axis=1) + 2) % 3 if len(faces) else np.zeros(0, dtype=np.int64)
    a, b, c = (_turned(faces, lone, k) for k in range(3))
    p, q = _turned(new_vertex, lone, 0), _turned(new_vertex, lone, 2)
    return [
        np.stack([a, p, q], axis=1),
        np.stack([p, b, c], axis=1),
        np.stack([p, c, q], axis=1),
    ]


def _turned(rows: Integers, first: Integers, step: int) -> Integers:
    return np.asarray(rows[np.arange(len(rows)), (first + step) % 3])


def chords(faces: Integers, on_boundary: Booleans) -> Integers:
    """Return the interior edges of one piece whose ends both lie on its boundary."""
    edges, counts = unique_edges(faces)
    return np.asarray(edges[(counts == 2) & on_boundary[edges].all(axis=1)])


def keep_largest_regions(faces: Integers, values: Floats) -> Floats:
    """Return values whose two signs occupy one connected region each.

    Every region of either sign but the largest, counted in vertices, changes its sign, first the
    negative ones, then the positive ones.
    """
    result = values.copy()
    for negative in (True, False):
        chosen = (result < 0) == negative
        islands = all_but_largest(faces, chosen)
        result[islands] = np.where(result[islands] < 0, -result[islands], -result[islands] - 1e-9)
    return result


def all_but_largest(faces: Integers, chosen: Booleans) -> Booleans:
    """Return the chosen vertices outside the largest connected region of them."""
    component = component_of_vertex(faces, len(chosen), chosen)
    sizes = np.bincount(component[chosen], minlength=int(component.max()) + 1)
    return np.asarray(chosen & (component != sizes.argmax()))
