"""Edges within divided faces turned: the same surface and flat map, cut into other triangles."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flyreg_core.correspondence import FlatBrain
from flyreg_core.cut import PIECES
from flyreg_core.flatten import Springs
from flyreg_core.halves import FlatHalf
from flyreg_core.landmarks import HalfName
from flyreg_core.mesh import Booleans, FlatMesh, Floats, Integers, SurfaceMesh
from flyreg_core.orientation import orientations
from flyreg_core.refine import edges_at_sides, faces_with_an_edge_among

LEAST_SHARE = 0.01
"""Both triangles of a quadrilateral have at least this share of its area."""
TURNED = ([0, 3, 2], [3, 1, 2])
"""The corners of the two triangles that its other diagonal makes, as `Diagonals` numbers them."""


@dataclass(frozen=True, eq=False)
class Diagonals:
    """Quadrilaterals of a half, each two parts of one face, with the diagonal that they may have too."""

    edge: Integers  # (q,), which of some edges the diagonal is that they have
    faces: Integers  # (q, 2), of the half, to its left and right
    corners: Integers  # (q, 4), own vertices: start and end of it, then the ones left and right
    shifts: Integers  # (q, 4), whole turns added to their u, so that they lie together
    places: Floats  # (q, 4, 2), where they lie flat

    def some(self, chosen: Integers | Booleans) -> Diagonals:
        """Return some of them."""
        return Diagonals(
            self.edge[chosen],
            self.faces[chosen],
            self.corners[chosen],
            self.shifts[chosen],
            self.places[chosen],
        )


def find_diagonals(
    half: FlatHalf, vertices: Floats, edges: Integers, origin: Integers
) -> Diagonals:
    """Return which edges of a half can be turned, changing neither its surface nor its flat map.

    That is where both faces are parts of one, and together convex, exactly so where they lie flat.

    Parameters
    ----------
    vertices : (n, 3) float
        Where the half's vertices are in space.
    edges : (k, 2) int
        Own numbers, lower first.
    origin : (m,) int
        The face that each of the half's faces is a part of.
    """
    number, sides = _sides_of(edges, half.faces, len(half.flat.uv))
    face, side = np.divmod(sides, 3)  # (q, 2), where each edge runs along, and back
    is_within = origin[face[:, 0]] == origin[face[:, 1]]
    number, face, side = number[is_within], face[is_within], side[is_within]
    rows = np.concatenate([face[:, [0, 0, 0]], face[:, [1]]], axis=1)
    columns = np.stack([side[:, 0], side[:, 0] + 1, side[:, 0] + 2, side[:, 1] + 2], axis=1) % 3
    shifts = half.flat.corner_shifts[rows, columns]
    # its start is seen by both faces, perhaps some turns apart
    shifts[:, 3] += shifts[:, 0] - half.flat.corner_shifts[face[:, 1], (side[:, 1] + 1) % 3]
    corners = half.faces[rows, columns]
    places = half.flat.uv[corners]
    places[..., 0] += shifts
    found = Diagonals(number, face, corners, shifts, places)
    return found.some(_are_convex(found, vertices[corners]))


def _sides_of(edges: Integers, faces: Integers, n: int) -> tuple[Integers, Integers]:
    """Return those of some edges that two faces share, and (q, 2) which of all faces' sides they are."""
    near = faces_with_an_edge_among(faces, edges)
    number = edges_at_sides(faces[near], edges, n)
    row, side = np.nonzero(number >= 0)
    number, all_sides = number[row, side], 3 * near[row] + side
    by_edge = np.argsort(number, kind="stable")
    number, all_sides = number[by_edge], all_sides[by_edge]
    first = np.flatnonzero(number[1:] == number[:-1])
    return number[first], np.stack([all_sides[first], all_sides[first + 1]], axis=1)


def _are_convex(diagonals: Diagonals, points: Floats) -> Booleans:
    """Tell whether the other diagonal divides each into two triangles too, on the surface and flat."""
    start, end, left, right = points.transpose(1, 0, 2)
    normals = np.cross(end - start, left - start)
    parts = [
        np.einsum("ij,ij->i", np.cross(second - first, left - first), normals)
        for first, second in ((start, right), (right, end))
    ]
    least = np.minimum(*parts) > LEAST_SHARE * (parts[0] + parts[1])
    signs = [orientations(diagonals.places[:, corners]) for corners in TURNED]
    return np.asarray(least & (signs[0] > 0) & (signs[1] > 0))


def turn_edges(brain: FlatBrain, name: HalfName, diagonals: Diagonals) -> FlatBrain:
    """Return a brain with edges of a half turned to the other diagonals.

    Parameters
    ----------
    diagonals : Diagonals
        No face may be among them twice.
    """
    half, old = brain.halves[name], brain.dissection
    faces, shifts = np.array(half.faces), np.array(half.flat.corner_shifts)
    for number, corners in enumerate(TURNED):
        faces[diagonals.faces[:, number]] = diagonals.corners[:, corners]
        shifts[diagonals.faces[:, number]] = diagonals.shifts[:, corners]
    turned = replace(
        half,
        flat=FlatMesh(half.flat.uv, faces, shifts),
        springs=_turned_springs(half.springs, diagonals, len(half.flat.uv)),
    )
    all_faces = np.array(old.surface.faces)
    all_faces[old.piece_of_face == PIECES.index(name)] = half.vertex_of[faces]
    dissection = replace(old, surface=SurfaceMesh(old.surface.vertices, all_faces))
    return replace(brain, dissection=dissection, halves={**brain.halves, name: turned})


def _turned_springs(springs: Springs, diagonals: Diagonals, n: int) -> Springs:
    """Return springs with some turned, each as strong as it was."""
    start, end, left, right = diagonals.corners.T
    keys = springs.edges @ [n, 1]
    place = np.searchsorted(keys, np.minimum(start, end) * n + np.maximum(start, end))
    keys[place] = np.minimum(left, right) * n + np.maximum(left, right)
    jumps = np.array(springs.jumps)
    jump = diagonals.shifts[:, 3] - diagonals.shifts[:, 2]
    jumps[place] = np.where(left < right, jump, -jump)
    order = np.argsort(keys)
    edges = np.stack(np.divmod(keys[order], n), axis=1)
    return Springs(edges, jumps[order], springs.weights[order])
