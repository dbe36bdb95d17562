"""A flat brain with edges divided: the same surface, curves and flat map, with more vertices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from flyreg_core.boundary import Curve, CurveKey
from flyreg_core.correspondence import FlatBrain
from flyreg_core.cut import PIECES, Dissection
from flyreg_core.flatten import Springs
from flyreg_core.halves import FlatHalf, along_outer
from flyreg_core.landmarks import HALVES
from flyreg_core.mesh import Booleans, FlatMesh, Floats, Integers, SurfaceMesh
from flyreg_core.orientation import face_orientations
from flyreg_core.rectangle import perimeter_share
from flyreg_core.refine import AddedVertices, Refinement, side_keys, split_edges


@dataclass(frozen=True, eq=False)
class Divided:
    """A brain after a division."""

    brain: FlatBrain
    parent: Integers  # (m,), of the surface: the old face each new face is part of
    is_divided: Booleans  # (k,); not those where rounding would turn parts of flat faces over


def divide(brain: FlatBrain, edges: Integers, share: Floats) -> Divided:
    """Return a flat brain with some edges of its halves, caps and curves divided.

    Parameters
    ----------
    edges : (k, 2) int
        Edges of the surface, lower vertex first, in order, no two alike; no face may have all three
        sides among them.
    share : (k,) float
        How far along each edge, from its lower vertex.

    Notes
    -----
    New vertices are numbered after the old ones, in the order of the edges that they divide; the old
    ones stay where they are, in space and laid flat.
    An edge of a curve is divided in all that share the curve, so both halves stay sewn together.
    """
    old = brain.dissection
    faces, n = old.surface.faces, len(old.surface.vertices)
    is_divided = np.ones(len(edges), dtype=bool)
    while True:
        refinement = split_edges(faces, edges[is_divided], share[is_divided])
        piece = old.piece_of_face[refinement.parent]
        divided = {half: _divided_half(brain.halves[half], old, refinement) for half in HALVES}
        turned = np.concatenate([parents for _, parents in divided.values()])
        if not len(turned):
            break
        is_divided &= ~np.isin(edges @ [n, 1], side_keys(faces[turned], n))
    surface = SurfaceMesh(refinement.carry(old.surface.vertices), refinement.faces)
    dissection = replace(old, surface=surface, piece_of_face=piece)
    curves = {key: _divided_curve(curve, refinement, n) for key, curve in brain.curves.items()}
    halves = {half: _with_boundary(own, curves) for half, (own, _) in divided.items()}
    added = brain.added.joined(refinement.added)
    result = FlatBrain(dissection, brain.frame, curves, halves, added)
    return Divided(result, refinement.parent, is_divided)


def _divided_half(
    half: FlatHalf, old: Dissection, refinement: Refinement
) -> tuple[FlatHalf, Integers]:
    """Return a half with its faces divided, and the old faces some part of which is turned over.

    Its loops are still those of before.
    """
    n, number = len(old.surface.vertices), PIECES.index(half.name)
    in_half = old.piece_of_face == number
    own_parts = np.flatnonzero(in_half[refinement.parent])
    faces, parent = refinement.faces[own_parts], refinement.parent[own_parts]
    first, second, third = (faces >= n).T
    new = np.flatnonzero(first | second | third)
    added = np.unique(faces[new])
    vertex_of = np.concatenate([half.vertex_of, added[added >= n]])
    own_faces = _own_numbers(vertex_of, faces)
    own_parent = old.own_face[parent]
    places = half.flat.corners[own_parent[new]]
    corners = _corners(faces[new], old.surface.faces[parent[new]], places, refinement, n)
    uv = np.zeros((len(vertex_of), 2))
    uv[own_faces[new]] = corners
    uv[: len(half.vertex_of)] = half.flat.uv
    shifts = half.flat.corner_shifts[own_parent]
    shifts[new] = np.rint(corners[..., 0] - uv[own_faces[new], 0])
    flat = FlatMesh(uv, own_faces, shifts)
    on_edge = vertex_of[len(half.vertex_of) :] - n
    own_added = AddedVertices(
        _own_numbers(vertex_of, refinement.added.ends[on_edge]), refinement.added.share[on_edge]
    )
    springs = _divided_springs(half.springs, flat, new, own_added)
    turned = parent[new[face_orientations(flat, new) <= 0]]
    return replace(half, vertex_of=vertex_of, flat=flat, springs=springs), turned


def _own_numbers(vertex_of: Integers, vertices: Integers) -> Integers:
    """Return where vertices of the whole surface are among those of a half."""
    number = np.zeros(int(vertex_of[-1]) + 1, dtype=np.int64)
    number[vertex_of] = np.arange(len(vertex_of))
    return np.asarray(number[vertices])


def _corners(
    faces: Integers, parents: Integers, places: Floats, refinement: Refinement, n_old: int
) -> Floats:
    """Return the (m, 3, 2) places of the corners of faces within their parents.

    `parents` and `places` are the corners of the (m,) parents and where they lie.
    """
    is_new = faces >= n_old
    on_edge = faces[is_new] - n_old
    ends, share = np.stack([faces, faces], axis=-1), np.zeros(faces.shape)
    ends[is_new], share[is_new] = refinement.added.ends[on_edge], refinement.added.share[on_edge]
    corner = (ends[..., np.newaxis] == parents[:, np.newaxis, np.newaxis]).argmax(axis=-1)
    first, second = places[np.arange(len(faces))[:, np.newaxis], corner.transpose(2, 0, 1)]
    # so that what lies between two places on a straight side lies there too, to the last bit
    return np.asarray(first + share[..., np.newaxis] * (second - first))


def _divided_springs(
    springs: Springs, flat: FlatMesh, new_faces: Integers, added: AddedVertices
) -> Springs:
    """Return springs along the edges of a half that vertices were added to.

    Whole edges keep theirs; the parts of an edge are the stronger the shorter they are; edges across
    faces are as strong as an edge that was divided there.
    """
    n = len(flat.uv)
    n_old = n - len(added)
    keys, first = np.unique(side_keys(flat.faces[new_faces], n), return_index=True)
    is_new = keys % n >= n_old
    low, high = np.divmod(keys[is_new], n)
    face, side = np.divmod(first[is_new], 3)
    shifts, following = flat.corner_shifts[new_faces[face]], (side + 1) % 3
    rows = np.arange(len(face))
    jumps = shifts[rows, following] - shifts[rows, side]
    jumps = np.where(flat.faces[new_faces[face], side] == low, jumps, -jumps)
    known = springs.edges @ [n, 1]
    divided = np.searchsorted(known, added.ends @ [n, 1])
    number = high - n_old
    weights = springs.weights[divided[number]] * added.stiffening(number, low, 1.0)
    all_keys = np.concatenate([np.delete(known, divided), keys[is_new]])
    order = np.argsort(all_keys, kind="stable")
    return Springs(
        np.stack(np.divmod(all_keys[order], n), axis=1),
        np.concatenate([np.delete(springs.jumps, divided), jumps])[order],
        np.concatenate([np.delete(springs.weights, divided), weights])[order],
    )


def _divided_curve(curve: Curve, refinement: Refinement, n_old: int) -> Curve:
    """Return a curve with the new vertices on it, as far along as on the edges they divide."""
    sides = np.stack([curve.vertices[:-1], curve.vertices[1:]], axis=1)
    added = refinement.added
    keys, known = np.sort(sides, axis=1) @ [n_old, 1], added.ends @ [n_old, 1]
    place = np.minimum(np.searchsorted(known, keys), max(len(known) - 1, 0))
    at = np.flatnonzero(known[place] == keys) if len(known) else place[:0]
    number = place[at]
    share = np.where(sides[at, 0] < sides[at, 1], added.share[number], 1 - added.share[number])

    def between(values: Floats) -> Floats:
        step = values[at + 1] - values[at]
        new = values[at] + share.reshape(-1, *[1] * (values.ndim - 1)) * step
        return np.insert(values, at + 1, new, axis=0)

    vertices = np.insert(curve.vertices, at + 1, n_old + number)
    return Curve(vertices, between(curve.share), between(curve.points))


def _with_boundary(half: FlatHalf, curves: Mapping[CurveKey, Curve]) -> FlatHalf:
    """Return a half with its loops along the curves."""
    hole = curves["hole", None]
    vertices = {key: curve.vertices for key, curve in curves.items()}
    shares = {key: perimeter_share(key[0], curve.share) for key, curve in curves.items()}
    return replace(
        half,
        outer=_own_numbers(half.vertex_of, along_outer(half.name, vertices)),
        outer_share=along_outer(half.name, shares),
        hole=_own_numbers(half.vertex_of, hole.vertices[:-1]),
        hole_share=shares["hole", None][:-1],
    )
