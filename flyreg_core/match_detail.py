"""Stage 5c: the faces of each brain divided where the other one is more detailed.

A face of the source spans in one plane what may be a furrow of the target: its corners come to lie
on the target, its middle does not. Dividing it changes neither the source's surface nor how its
halves lie flat, and lets the new vertices follow the target too. An edge is divided where it leaves
the target most, which is where it crosses a ridge or the bottom of a furrow.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce

import numpy as np

from flyreg_core.caps import Cap, cap_grid, find_caps, lay_cap_flat, rim_circle, rim_places
from flyreg_core.chordal_deviation import Ground, chordal_deviations
from flyreg_core.correspondence import FlatBrain
from flyreg_core.cut import PIECES
from flyreg_core.divide import divide
from flyreg_core.flatten import Springs
from flyreg_core.landmarks import HALVES, HalfName
from flyreg_core.locate import strip_grid
from flyreg_core.mesh import Booleans, Floats, Integers
from flyreg_core.progress import Report
from flyreg_core.refine import edges_at_sides, faces_with_an_edge_among
from flyreg_core.turn_edges import find_diagonals, turn_edges

TOLERANCE, FINEST = 1e-4, 1e-6
"""An edge may leave the other surface by this share of its diagonal before it is divided; and where
the user says how many vertices there shall be."""
MOST_GROWTH = 0.5
"""Else so many vertices are added at most, as a share of those of the more detailed brain."""
ROUNDS = 8


def match_detail(
    brain: FlatBrain, other: FlatBrain, report: Report, vertices: int | None = None
) -> FlatBrain:
    """Return a flat brain with edges divided where they leave the other brain's surface.

    Both brains lie flat on the same strips, so that the same anatomy is in one place. A brain that
    nowhere leaves the other one is returned as it is.

    Parameters
    ----------
    vertices : int, optional
        How many the brain has afterwards, at most. Without, edges are divided that leave the
        surface by more than `TOLERANCE`, until there are `MOST_GROWTH` more.

    Notes
    -----
    The ends of an edge, of a curve or a trim cap too, are lifted to the other surface: their chord
    is what the registered surface has there. What an edge costs is the area between that chord and
    the surface below the edge. Each round divides the edges that cost most, each where it is
    farthest off, and turns those that are new where the other diagonal of two parts of a face costs
    less: else edges would fan out from the border of a pocket for ever.

    References
    ----------
    Dyn, Levin, Rippa, Data dependent triangulations for piecewise linear interpolation, IMA Journal
    of Numerical Analysis 10(1), 1990, doi:10.1093/imanum/10.1.137.
    """
    grounds = {piece: _ground(other, piece) for piece in PIECES}
    n_before, n_other = (len(each.dissection.surface.vertices) for each in (brain, other))
    most = n_before + int(MOST_GROWTH * max(n_before, n_other)) if vertices is None else vertices
    limit = (TOLERANCE if vertices is None else FINEST) * other.dissection.surface.diagonal
    on_caps = _places_on_caps(brain, other)
    sheets = _sheets(brain, on_caps)
    lifted = _lifted(sheets, grounds, n_before)
    edges = _far_edges(0, sheets, grounds, lifted, limit)
    origin = np.arange(len(brain.dissection.surface.faces))
    for number in range(ROUNDS):
        report(number / ROUNDS, "matching detail")
        n = len(lifted)
        chosen = edges.worst((most - n) // (ROUNDS - number))
        chosen = chosen[_at_most_two_a_face(brain.dissection.surface.faces, edges.ends[chosen])]
        if not len(chosen):
            break
        chosen = chosen[np.argsort(edges.ends[chosen] @ [n, 1])]
        divided = divide(brain, edges.ends[chosen], edges.share[chosen])
        brain = divided.brain
        done = chosen[divided.is_divided]
        first, second = on_caps[edges.ends[done].T]
        lifted = np.concatenate([lifted, edges.points[done]])
        on_caps = np.concatenate(
            [on_caps, first + edges.share[done, np.newaxis] * (second - first)]
        )
        new = _far_edges(n, _sheets(brain, on_caps), grounds, lifted, limit)
        origin = origin[divided.parent]
        for half in HALVES:
            brain, new = _better_turned(brain, half, new, origin, grounds[half], lifted, limit)
        edges = edges.without(chosen).joined(new)
    return brain


def _lifted(sheets: list[_Sheet], grounds: Mapping[str, Ground], n_vertices: int) -> Floats:
    """Return (n, 3) where the vertices of a brain come to lie on the other surface."""
    lifted = np.zeros((n_vertices, 3))
    for sheet in sheets:
        lifted[sheet.vertex_of] = grounds[sheet.piece].lift(sheet.places)
    return lifted


def _better_turned(
    brain: FlatBrain,
    name: HalfName,
    edges: _Edges,
    origin: Integers,
    ground: Ground,
    lifted: Floats,
    limit: float,
) -> tuple[FlatBrain, _Edges]:
    """Return a brain and its edges, those of a half turned that cost less as the other diagonals.

    Caps are left as they are: they have no flat map of their own that would stay the same.

    Parameters
    ----------
    origin : (m,) int
        The face that each face of the surface was a part of before all division.
    """
    half = brain.halves[name]
    number = np.full(len(lifted), -1)
    number[half.vertex_of] = np.arange(len(half.vertex_of))
    inside = np.flatnonzero((number[edges.ends] >= 0).all(axis=1))
    found = find_diagonals(
        half,
        brain.dissection.surface.vertices[half.vertex_of],
        number[edges.ends[inside]],
        origin[brain.dissection.piece_of_face == PIECES.index(name)],
    )
    ends = half.vertex_of[found.corners[:, 2:]]
    first, second = found.places[:, 2], found.places[:, 3]
    off = chordal_deviations(ground, first, second - first, lifted[ends])
    turned = _apart(found.faces, edges.cost[inside[found.edge]] - off.area)
    far = turned[off.most[turned] > limit]
    share = np.where(ends[far, 0] < ends[far, 1], off.share[far], 1 - off.share[far])
    instead = _Edges(np.sort(ends[far], axis=1), off.area[far], share, off.points[far])
    brain = turn_edges(brain, name, found.some(turned))
    return brain, edges.without(inside[found.edge[turned]]).joined(instead)


def _apart(faces: Integers, gain: Floats) -> Integers:
    """Return which of some pairs of faces gain something, and more than all that share a face."""
    rank = np.argsort(np.argsort(-gain, kind="stable"))
    best = np.full(int(faces.max(initial=-1)) + 1, len(rank))
    np.minimum.at(best, faces, rank[:, np.newaxis])
    return np.flatnonzero((gain > 0) & (best[faces] == rank[:, np.newaxis]).all(axis=1))


def _ground(brain: FlatBrain, piece: str) -> Ground:
    surface = brain.dissection.surface
    half = next((brain.halves[half] for half in HALVES if half == piece), None)
    if half is not None:
        grid = strip_grid(half.flat)
    else:
        cap = next(cap for cap in _caps(brain) if f"{cap.side} cap" == piece)
        grid = cap_grid(cap, lay_cap_flat(cap, rim_circle(cap.side, brain.curves)))
    normals = surface.face_normals[brain.dissection.piece_of_face == PIECES.index(piece)]
    size = np.sqrt(np.einsum("ij,ij->i", normals, normals))[:, np.newaxis]
    corners = surface.vertices[brain.dissection.faces_of(piece)]
    return Ground(grid, half is not None, corners, normals / np.maximum(size, np.finfo(float).tiny))


@dataclass(frozen=True, eq=False)
class _Sheet:
    """A piece of the brain laid flat on the other one's."""

    piece: str
    vertex_of: Integers  # (k,)
    springs: Springs
    places: Floats  # (k, 2)


def _sheets(brain: FlatBrain, on_caps: Floats) -> list[_Sheet]:
    """Return both halves, then both caps."""
    halves = [brain.halves[half] for half in HALVES]
    return [
        *(_Sheet(own.name, own.vertex_of, own.springs, own.flat.uv) for own in halves),
        *(
            _Sheet(f"{cap.side} cap", cap.vertex_of, cap.springs, on_caps[cap.vertex_of])
            for cap in _caps(brain)
        ),
    ]


def _caps(brain: FlatBrain) -> tuple[Cap, Cap]:
    return find_caps(brain.dissection, brain.curves, brain.added)


def _places_on_caps(brain: FlatBrain, other: FlatBrain) -> Floats:
    """Return (n, 2) where the vertices of a brain's caps lie on the other one's, laid flat."""
    shares = {key: curve.share for key, curve in brain.curves.items()}
    places = np.zeros((len(brain.dissection.surface.vertices), 2))
    for cap in _caps(brain):
        places[cap.vertex_of] = lay_cap_flat(cap, rim_places(cap.side, shares, other.curves))
    return places


@dataclass(frozen=True, eq=False)
class _Edges:
    """Edges, each once, that do not fit the other surface."""

    ends: Integers  # (e, 2), lower vertex first
    cost: Floats  # (e,), square micrometres
    share: Floats  # (e,), how far along they are farthest off
    points: Floats  # (e, 3), of the other surface there

    def worst(self, most: int) -> Integers:
        """Return the numbers of up to so many edges that cost most, by falling cost."""
        return np.argsort(-self.cost, kind="stable")[: max(most, 0)]

    def without(self, chosen: Integers) -> _Edges:
        """Return all edges but some."""
        kept = np.ones(len(self.ends), dtype=bool)
        kept[chosen] = False
        return _Edges(self.ends[kept], self.cost[kept], self.share[kept], self.points[kept])

    def joined(self, others: _Edges) -> _Edges:
        """Return these edges and others."""
        return _Edges(
            np.concatenate([self.ends, others.ends]),
            np.concatenate([self.cost, others.cost]),
            np.concatenate([self.share, others.share]),
            np.concatenate([self.points, others.points]),
        )


def _far_edges(
    first_new: int,
    sheets: list[_Sheet],
    grounds: Mapping[str, Ground],
    lifted: Floats,
    limit: float,
) -> _Edges:
    """Return those edges that end in a vertex from a number on and are farther off than a limit.

    Parameters
    ----------
    lifted : (n, 3) float
        Where all vertices come to lie on the other surface.
    """
    found = []
    sheet_of = np.zeros(len(lifted), dtype=np.int64)  # bit by bit
    for number, sheet in enumerate(sheets):
        edges = sheet.springs.edges
        new = np.flatnonzero(edges[:, 1] >= np.searchsorted(sheet.vertex_of, first_new))
        ends = sheet.vertex_of[edges[new]]
        # an edge across a piece does not join its boundary: with both ends in another one, it is seen
        is_seen = (sheet_of[ends[:, 0]] & sheet_of[ends[:, 1]]) > 0
        sheet_of[sheet.vertex_of] |= 1 << number
        new, ends = new[~is_seen], ends[~is_seen]
        first, second = sheet.places[edges[new].T]
        steps = second - first
        steps[:, 0] += sheet.springs.jumps[new]
        off = chordal_deviations(grounds[sheet.piece], first, steps, lifted[ends])
        far = np.flatnonzero(off.most > limit)
        found.append(_Edges(ends[far], off.area[far], off.share[far], off.points[far]))
    return reduce(_Edges.joined, found)


def _at_most_two_a_face(faces: Integers, edges: Integers) -> Booleans:
    """Tell which edges are left if of each face with all three sides among them the last is left out."""
    near = faces_with_an_edge_among(faces, edges)
    number = edges_at_sides(faces[near], edges, int(faces.max()) + 1)
    is_whole = (number >= 0).all(axis=1)
    kept = np.ones(len(edges), dtype=bool)
    kept[number[is_whole].max(axis=1)] = False
    return kept
