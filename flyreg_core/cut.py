"""Stage 4: the main brain into two caps and two halves, with the cuts as edges of the mesh.

The caps are what the trim planes left flat. The rest is a tube, which a surface across the axis
of the oesophagus divides into an anterior and a posterior half, each a ring around the hole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flyreg_core.errors import TopologyError
from flyreg_core.mesh import Booleans, Floats, Integers, SurfaceMesh
from flyreg_core.refine import (
    Refinement,
    chords,
    keep_largest_regions,
    split_along_zero,
    split_edges,
)
from flyreg_core.topology import euler_characteristic, half_edges
from flyreg_core.torus import Torus

PIECES = ("anterior", "posterior", "right cap", "left cap")
CAP_DEPTH = 0.3
"""How far inside a trim plane the cap ends, in voxels of the torus."""


@dataclass(frozen=True)
class CutParameters:
    """How far behind the automatic place the halves are divided, micrometres."""

    shift_um: float = 0.0


@dataclass(frozen=True, eq=False)
class Dissection:
    """The main brain with its cuts drawn: the same surface, refined along them."""

    surface: SurfaceMesh
    piece_of_face: Integers  # (m,), index into PIECES
    cut_knots: (
        Floats  # (3, 2): left-right and antero-posterior coordinate of the cut at three places
    )

    def faces_of(self, piece: str) -> Integers:
        """Return the faces of one piece, with the vertex numbers of the whole surface."""
        return np.asarray(self.surface.faces[self.piece_of_face == PIECES.index(piece)])


def dissect(
    torus: Torus, surface: SurfaceMesh, smoothed: Floats, parameters: CutParameters
) -> Dissection:
    """Return the surface divided into two halves and two caps.

    Parameters
    ----------
    surface : SurfaceMesh
        The torus' surface, simplified or not.
    smoothed : (n, 3) float
        Its vertices after smoothing; they decide which half a vertex belongs to.

    Raises
    ------
    TopologyError
        A piece does not have the shape it must have.

    Notes
    -----
    The cut runs through the middles of both trim openings and of the narrowest place of the
    oesophagus, straight between them (3.1 B of the paper halves the bounding box, which misses a
    trim opening in some brains). Its height decides the side of each vertex; islands change side;
    the line is drawn between vertices of different sides, so it is made of simple closed curves.
    """
    lr, ap = torus.frame.left_right, torus.frame.antero_posterior
    x = surface.vertices[:, lr]
    depth = CAP_DEPTH * torus.pitch
    right = keep_largest_regions(surface.faces, x - torus.planes.right - depth)
    left = keep_largest_regions(surface.faces, torus.planes.left - depth - x)
    for name, field in (("right", right), ("left", left)):
        if not (field < 0).any():
            raise TopologyError(f"the {name} trim plane does not touch the brain; move it inwards")
    places = (right < 0, _around_oesophagus(torus, surface), left < 0)
    knots = np.array([smoothed[place].mean(axis=0)[[lr, ap]] for place in places])
    knots[:, 1] += parameters.shift_um
    height = smoothed[:, ap] - np.interp(smoothed[:, lr], knots[:, 0], knots[:, 1])
    height = keep_largest_regions(surface.faces, height)
    if not (height < 0).any() or not (height >= 0).any():
        raise TopologyError("the cut leaves nothing on one side of it; move the cut height back")
    fields = np.stack([right, left, height], axis=1)
    vertices, faces, is_beyond = _split_by_fields(surface, fields)
    piece = np.where(is_beyond[:, 2], 0, 1)
    piece[is_beyond[:, 1]] = 3
    piece[is_beyond[:, 0]] = 2
    vertices, faces, piece = _split_chords(vertices, faces, piece)
    dissection = Dissection(SurfaceMesh(vertices, faces), piece.astype(np.int64), knots)
    _check(dissection)
    return dissection


def _around_oesophagus(torus: Torus, surface: SurfaceMesh) -> Booleans:
    """Return the vertices around the narrowest place of the oesophagus."""
    center = np.array(torus.oesophagus.center_um)
    away = np.linalg.norm(surface.vertices - center, axis=1)
    return np.asarray(away <= away.min() + torus.pitch)


def _split_by_fields(surface: SurfaceMesh, fields: Floats) -> tuple[Floats, Integers, Booleans]:
    """Split along the zeros of each column; also tell for each face where each is negative."""
    vertices, faces = np.array(surface.vertices), np.array(surface.faces)
    is_beyond = np.zeros((len(faces), 0), dtype=bool)
    for column in range(fields.shape[1]):
        refinement = split_along_zero(faces, fields[:, column])
        side = refinement.sides(fields[:, column])
        is_beyond = np.column_stack([is_beyond[refinement.parent], ~side])
        vertices, fields = refinement.carry(vertices), refinement.carry(fields)
        faces = refinement.faces
    return vertices, faces, is_beyond


def _split_chords(
    vertices: Floats, faces: Integers, piece: Integers
) -> tuple[Floats, Integers, Integers]:
    """Split each edge that crosses a piece from boundary to boundary.

    On a straight side of the flat domain such an edge would flatten whatever it cuts off.
    """
    while True:
        found = [
            chords(faces[piece == p], _on_boundary(faces[piece == p], len(vertices)))
            for p in range(len(PIECES))
        ]
        edges = _without_whole_faces(np.concatenate(found), faces)
        if len(edges) == 0:
            return vertices, faces, piece
        refinement: Refinement = split_edges(faces, edges)
        vertices, faces = refinement.carry(vertices), refinement.faces
        piece = piece[refinement.parent]


def _on_boundary(faces: Integers, n_vertices: int) -> Booleans:
    directed = half_edges(faces)
    forward = directed[:, 0] * n_vertices + directed[:, 1]
    backward = directed[:, 1] * n_vertices + directed[:, 0]
    result = np.zeros(n_vertices, dtype=bool)
    result[directed[~np.isin(forward, backward)]] = True
    return result


def _without_whole_faces(edges: Integers, faces: Integers) -> Integers:
    """Leave out one edge of each face that has all three among the edges."""
    n = int(faces.max()) + 1
    key = edges[:, 0] * n + edges[:, 1]
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    side_key = sides[..., 0] * n + sides[..., 1]
    whole = np.isin(side_key, key).all(axis=1)
    return np.asarray(edges[~np.isin(key, side_key[whole, 0])])


def _check(dissection: Dissection) -> None:
    for piece, expected, shape in (
        ("anterior", 0, "ring"),
        ("posterior", 0, "ring"),
        ("right cap", 1, "disk"),
        ("left cap", 1, "disk"),
    ):
        found = euler_characteristic(dissection.faces_of(piece))
        if found != expected:
            raise TopologyError(
                f"the {piece} is not a {shape} (Euler characteristic {found}, not {expected}): the "
                "cut does not run once through the oesophagus and both trim openings; move the cut "
                "height or the trim planes"
            )
