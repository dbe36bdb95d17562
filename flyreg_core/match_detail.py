"""Stage 5c: the faces of each brain divided where the other one is more detailed.

A face of the source spans in one plane what may be a furrow of the target: its corners come to lie
on the target, its middle does not. Dividing it changes neither the source's surface nor how its
halves lie flat, and lets the new vertices follow the target too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flyreg_core.correspondence import FlatBrain
from flyreg_core.cut import PIECES
from flyreg_core.divide import divide
from flyreg_core.halves import FlatHalf
from flyreg_core.landmarks import HALVES, HalfName
from flyreg_core.lift import lift_into, lift_table
from flyreg_core.locate import TriangleGrid, strip_grid
from flyreg_core.mesh import Booleans, Floats, Integers
from flyreg_core.progress import Report
from flyreg_core.refine import side_keys

TOLERANCE = 1e-4
"""An edge may leave the other surface by this share of its diagonal before it is divided."""
MOST_GROWTH = 0.5
"""So many vertices are added at most, as a share of those there are: the worst edges first."""
ROUNDS = 5
ALONG = 0.3
"""What the middle of an edge is off along the other surface counts so much, against 1 across it."""


def match_detail(brain: FlatBrain, other: FlatBrain, report: Report) -> FlatBrain:
    """Return a flat brain with edges divided where they leave the other brain's surface.

    Both brains lie flat so that the same anatomy is in one place. A brain that nowhere leaves the
    other one is returned as it is.

    Notes
    -----
    The middle of an edge of a half, a curve's too, is lifted to the other surface, and so are its
    ends: their chord is what the registered surface has there. What an edge costs is how far its
    middle lies off the chord, mainly across the surface, times the chord's length. Each round
    divides the edges that cost most, and looks at those that are new.
    """
    onto = {half: _other_half(other, half) for half in HALVES}
    limit = TOLERANCE * other.dissection.surface.diagonal
    n_before = len(brain.dissection.surface.vertices)
    most = int((1 + MOST_GROWTH) * n_before)
    lifted = np.zeros((n_before, 3))
    for half in HALVES:
        own = brain.halves[half]
        lifted[own.vertex_of] = onto[half].lift(own, own.flat.uv)[0]
    edges = _far_edges(0, brain, onto, lifted, limit)
    for number in range(ROUNDS):
        report(number / ROUNDS, "matching detail")
        n = len(lifted)
        chosen = edges.worst((most - n) // (ROUNDS - number))
        chosen = chosen[_at_most_two_a_face(brain.dissection.surface.faces, edges.ends[chosen])]
        if not len(chosen):
            break
        chosen = chosen[np.argsort(edges.ends[chosen] @ [n, 1])]
        divided = divide(brain, edges.ends[chosen])
        brain = divided.brain
        lifted = np.concatenate([lifted, edges.middles[chosen[divided.is_divided]]])
        edges = edges.without(chosen).joined(_far_edges(n, brain, onto, lifted, limit))
    return brain


@dataclass(frozen=True, eq=False)
class _OtherHalf:
    """A half of the other brain, and what lifting places to its surface needs."""

    half: FlatHalf
    grid: TriangleGrid
    table: Floats  # see `lift_table`
    normals: Floats  # (m, 3), unit, of its faces

    def lift(self, own: FlatHalf, uv: Floats) -> tuple[Floats, Integers]:
        """Return the (k, 3) points at (k, 2) places of another brain's half, and the faces there."""
        beta = np.clip(own.law.beta(uv[:, 1]), 0.0, 1.0)
        places = np.stack([uv[:, 0], self.half.law.v(beta)], axis=1)
        points, rows = np.zeros((len(uv), 3)), np.arange(len(uv))
        faces = lift_into(points, rows, places, self.half.name, self.grid, self.table, None)
        return points, faces


def _other_half(brain: FlatBrain, name: HalfName) -> _OtherHalf:
    half, surface = brain.halves[name], brain.dissection.surface
    grid = strip_grid(half.flat)
    normals = surface.face_normals[brain.dissection.piece_of_face == PIECES.index(name)]
    size = np.maximum(_lengths(normals), np.finfo(float).tiny)
    return _OtherHalf(
        half, grid, lift_table(half, grid, surface.vertices), normals / size[:, np.newaxis]
    )


@dataclass(frozen=True, eq=False)
class _Edges:
    """Edges of both halves, each once, that do not fit the other surface."""

    ends: Integers  # (e, 2), lower vertex first
    middles: Floats  # (e, 3), where their middles come to lie on the other surface
    cost: Floats  # (e,), how far that is off the chord of their ends, times its length

    def worst(self, most: int) -> Integers:
        """Return the numbers of up to so many edges that cost most, by falling cost."""
        return np.argsort(-self.cost, kind="stable")[: max(most, 0)]

    def without(self, chosen: Integers) -> _Edges:
        """Return all edges but some."""
        kept = np.ones(len(self.ends), dtype=bool)
        kept[chosen] = False
        return _Edges(self.ends[kept], self.middles[kept], self.cost[kept])

    def joined(self, others: _Edges) -> _Edges:
        """Return these edges and others."""
        return _Edges(
            np.concatenate([self.ends, others.ends]),
            np.concatenate([self.middles, others.middles]),
            np.concatenate([self.cost, others.cost]),
        )


def _far_edges(
    first_new: int,
    brain: FlatBrain,
    onto: Mapping[HalfName, _OtherHalf],
    lifted: Floats,
    limit: float,
) -> _Edges:
    """Return those edges that end in a vertex from a number on and are farther off than a limit.

    Parameters
    ----------
    lifted : (n, 3) float
        Where all vertices of the halves come to lie on the other surface.
    """
    parts = []
    is_done = np.zeros(len(lifted), dtype=bool)
    for name in HALVES:
        own = brain.halves[name]
        new = np.flatnonzero(own.springs.edges[:, 1] >= np.searchsorted(own.vertex_of, first_new))
        ends = own.vertex_of[own.springs.edges[new]]
        # an edge across a half does not join its boundaries: with both ends in both it is on a seam
        is_seen = is_done[ends[:, 0]] & is_done[ends[:, 1]]
        is_done[own.vertex_of] = True
        new, ends = new[~is_seen], ends[~is_seen]
        first, second = own.springs.edges[new].T
        uv = (own.flat.uv[first] + own.flat.uv[second]) / 2
        uv[:, 0] += own.springs.jumps[new] / 2
        middles, face = onto[name].lift(own, uv)
        start, end = lifted[ends[:, 0]], lifted[ends[:, 1]]
        off = middles - (start + end) / 2
        across = np.abs(np.einsum("ij,ij->i", off, onto[name].normals[face]))
        along = np.sqrt(np.maximum(np.einsum("ij,ij->i", off, off) - across**2, 0.0))
        away = across + ALONG * along
        far = np.flatnonzero(away > limit)
        cost = (away * _lengths(end - start))[far]
        parts.append(_Edges(ends[far], middles[far], cost))
    return parts[0].joined(parts[1])


def _lengths(vectors: Floats) -> Floats:
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))


def _at_most_two_a_face(faces: Integers, edges: Integers) -> Booleans:
    """Tell which edges are left if of each face with all three sides among them the last is left out."""
    n = int(faces.max()) + 1
    keys = edges @ [n, 1]
    order = np.argsort(keys)
    is_end = np.zeros(n, dtype=bool)
    is_end[edges] = True
    first, second, third = is_end[faces].T
    sides = side_keys(faces[first & second & third], n)
    place = order[np.minimum(np.searchsorted(keys, sides, sorter=order), len(keys) - 1)]
    is_whole = (keys[place] == sides).all(axis=1)
    kept = np.ones(len(edges), dtype=bool)
    kept[place[is_whole].max(axis=1)] = False
    return kept
