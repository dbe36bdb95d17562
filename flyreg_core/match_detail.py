"""Stage 5c: each brain's faces divided where the other one is more detailed.

A face of the source spans in one plane what may be a furrow of the target: its corners come to lie
on the target, its middle does not. Dividing it changes neither the source's surface nor how its
halves lie flat, and lets the new vertices follow the target too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flyreg_core.correspondence import FlatBrain
from flyreg_core.cut import PIECES
from flyreg_core.flatten import Springs
from flyreg_core.halves import FlatHalf
from flyreg_core.landmarks import HALVES, HalfName
from flyreg_core.lift import lift_places
from flyreg_core.locate import strip_grid
from flyreg_core.mesh import Booleans, FlatMesh, Floats, Integers, SurfaceMesh
from flyreg_core.orientation import face_orientations
from flyreg_core.progress import Report
from flyreg_core.rectangle import to_plane
from flyreg_core.refine import Refinement, side_keys, split_edges

TOLERANCE = 2e-4
"""A side may leave the other surface by this share of its diagonal before it is divided."""
ROUNDS = 4
MOST_GROWTH = 0.4
"""So many vertices are added at most, as a share of those there are: the worst sides first."""


def match_detail(brain: FlatBrain, other: FlatBrain, report: Report) -> FlatBrain:
    """Return a flat brain with sides of its faces divided where they leave the other's surface.

    Both lie flat so that the same anatomy is in one place; boundary curves stay as they are. A side
    is not divided where rounding would turn a face of the flat half.
    """
    grids = {half: strip_grid(other.halves[half].flat) for half in HALVES}
    surface = other.dissection.surface
    limit = TOLERANCE * surface.diagonal
    left = int(MOST_GROWTH * len(brain.dissection.surface.vertices))
    for number in range(ROUNDS):
        report(number / ROUNDS, "matching detail")
        edges, away = [], []
        for half in HALVES:
            own = _inner_sides(brain.halves[half])
            flat = brain.halves[half]
            middles = to_plane(own.middles[:, 0], flat.law.beta(own.middles[:, 1]))
            places = np.concatenate([flat.plane, middles])
            lifted = lift_places(half, other, grids[half], places, surface.vertices)
            ends, between = lifted[: len(flat.plane)][own.edges], lifted[len(flat.plane) :]
            edges.append(flat.vertex_of[own.edges])
            away.append(np.linalg.norm(between - ends.mean(axis=1), axis=1))
        chosen = _worst(np.concatenate(edges), np.concatenate(away), limit, left)
        chosen = _two_a_face(brain.dissection.surface.faces, chosen)
        if not len(chosen):
            break
        before = len(brain.dissection.surface.vertices)
        brain = _divided(brain, chosen)
        left -= len(brain.dissection.surface.vertices) - before
    return brain


@dataclass(frozen=True, eq=False)
class _Sides:
    """The sides that two faces of a half share."""

    edges: Integers  # (e, 2), own vertices, lower first
    middles: Floats  # (e, 2), on the strip


def _inner_sides(half: FlatHalf) -> _Sides:
    n = len(half.vertex_of)
    keys, first, count = np.unique(side_keys(half.faces, n), return_index=True, return_counts=True)
    face, side = np.divmod(first[count == 2], 3)
    corners = half.flat.corners[face]
    rows = np.arange(len(face))
    middles = (corners[rows, side] + corners[rows, (side + 1) % 3]) / 2
    return _Sides(np.stack(np.divmod(keys[count == 2], n), axis=1), middles)


def _worst(edges: Integers, away: Floats, limit: float, most: int) -> Integers:
    """Return the edges that are farther away than a limit, the worst first."""
    order = np.argsort(-away)
    return edges[order[: min(int(np.count_nonzero(away > limit)), most)]]


def _two_a_face(faces: Integers, edges: Integers) -> Integers:
    """Return edges without the least of those of which a face has all three sides."""
    n = int(faces.max()) + 1
    keys = edges[:, 0] * n + edges[:, 1]
    order = np.argsort(keys)
    sides = side_keys(faces, n)
    place = np.minimum(np.searchsorted(keys[order], sides), max(len(keys) - 1, 0))
    is_chosen = keys[order][place] == sides if len(keys) else np.zeros(sides.shape, dtype=bool)
    rank = np.where(is_chosen, order[place] if len(keys) else -1, -1)
    dropped = rank[is_chosen.all(axis=1)].max(axis=1, initial=-1)
    return np.delete(edges, dropped, axis=0)


def _divided(brain: FlatBrain, edges: Integers) -> FlatBrain:
    """Return a brain with some inner sides of its halves divided in the middle.

    Sides of faces whose parts rounding would turn over are left whole.
    """
    while True:
        old = brain.dissection
        refinement = split_edges(old.surface.faces, edges)
        piece = old.piece_of_face[refinement.parent]
        divided = {
            half: _divided_half(brain, half, refinement, piece == PIECES.index(half))
            for half in HALVES
        }
        turned = np.concatenate([parents for _, parents in divided.values()])
        if not len(turned):
            break
        bad = side_keys(old.surface.faces[turned], len(old.surface.vertices))
        keys = edges[:, 0] * len(old.surface.vertices) + edges[:, 1]
        edges = edges[~np.isin(keys, bad)]
    surface = SurfaceMesh(refinement.carry(old.surface.vertices), refinement.faces)
    dissection = replace(old, surface=surface, piece_of_face=piece)
    halves = {half: flat for half, (flat, _) in divided.items()}
    return replace(brain, dissection=dissection, halves=halves)


def _divided_half(
    brain: FlatBrain, name: HalfName, refinement: Refinement, is_own: Booleans
) -> tuple[FlatHalf, Integers]:
    """Return a half with its sides divided, and the old faces some part of which is turned over."""
    half, old = brain.halves[name], brain.dissection
    n = len(old.surface.vertices)
    faces, parent = refinement.faces[is_own], refinement.parent[is_own]
    vertex_of = np.concatenate([half.vertex_of, np.unique(faces[faces >= n])])
    own_faces = np.searchsorted(vertex_of, faces)
    own_number = np.cumsum(old.piece_of_face == PIECES.index(name)) - 1
    parents = old.surface.faces[parent]
    places = half.flat.corners[own_number[parent]]
    corners = _corners(faces, parents, places, refinement, n)
    _, first = np.unique(own_faces, return_index=True)
    uv = corners.reshape(-1, 2)[first]
    uv[: len(half.vertex_of)] = half.flat.uv
    shifts = np.rint(corners[..., 0] - uv[own_faces][..., 0]).astype(np.int64)
    flat = FlatMesh(uv, own_faces, shifts)
    turned = parent[face_orientations(flat) <= 0]
    new_ends = np.searchsorted(vertex_of, refinement.ends[vertex_of[len(half.vertex_of) :] - n])
    springs = _springs(half, flat, new_ends)
    return replace(half, vertex_of=vertex_of, flat=flat, springs=springs), turned


def _corners(
    faces: Integers, parents: Integers, places: Floats, refinement: Refinement, n_old: int
) -> Floats:
    """Return the (m, 3, 2) places of the corners of faces within their parents.

    `parents` and `places` are the corners of the (m,) parents and where they lie.
    """
    is_old = faces < n_old
    ends = np.stack([faces, faces], axis=-1)
    ends[~is_old] = refinement.ends[faces[~is_old] - n_old]
    corner = (ends[..., np.newaxis] == parents[:, np.newaxis, np.newaxis]).argmax(axis=-1)
    rows = np.arange(len(faces))[:, np.newaxis, np.newaxis]
    return np.asarray(places[rows, corner].mean(axis=2))


def _springs(half: FlatHalf, flat: FlatMesh, new_ends: Integers) -> Springs:
    """Return springs along the sides of a divided half.

    Whole sides keep theirs; the parts of a side are twice as strong as it was, as springs are, and
    sides across faces are as strong as the mean.
    """
    n, n_old = len(flat.uv), len(half.vertex_of)
    keys, first = np.unique(side_keys(flat.faces, n), return_index=True)
    edges = np.stack(np.divmod(keys, n), axis=1)
    face, side = np.divmod(first, 3)
    following = (side + 1) % 3
    jumps = flat.corner_shifts[face, following] - flat.corner_shifts[face, side]
    jumps = np.where(flat.faces[face, side] < flat.faces[face, following], jumps, -jumps)
    known = half.springs.edges[:, 0] * n + half.springs.edges[:, 1]
    order = np.argsort(known)
    ends = edges.copy()
    is_new = edges[:, 1] >= n_old
    far = new_ends[edges[is_new, 1] - n_old]
    is_part = (far == edges[is_new, :1]).any(axis=1)
    ends[is_new] = np.where(is_part[:, np.newaxis], far, -1)
    wanted = ends[:, 0] * n + ends[:, 1]
    place = np.minimum(np.searchsorted(known[order], wanted), len(known) - 1)
    is_known = known[order][place] == wanted
    weights = np.full(len(edges), float(half.springs.weights.mean()))
    weights[is_known] = half.springs.weights[order][place[is_known]]
    weights[is_new & is_known] *= 2
    return Springs(edges, jumps, weights)
