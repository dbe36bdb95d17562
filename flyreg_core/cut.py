"""Stage 4: the main brain into two caps and two halves, with the cuts as edges of the mesh.

The caps are what the trim planes left flat. The rest is a tube, which a surface across the axis
of the oesophagus divides into an anterior and a posterior half, each a ring around the hole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from flyreg_core.errors import TopologyError
from flyreg_core.mesh import Booleans, Floats, Integers, SurfaceMesh
from flyreg_core.refine import (
    Refinement,
    all_but_largest,
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
TIDYING_ROUNDS = 3
SMALL = 1e-9
"""Makes a value that was exactly 0 negative."""
RING_REACH = 1.8
"""How far from the membrane across the oesophagus its ring of vertices reaches, in voxels."""
RING_INFLUENCE = 1.0
"""How far around the ring the cut follows it, in widths of the oesophagus."""


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
    ring = _ring_of_oesophagus(torus, surface)
    knots = np.array(
        [smoothed[place].mean(axis=0)[[lr, ap]] for place in (right < 0, ring, left < 0)]
    )
    knots[:, 1] += parameters.shift_um
    height = _height_over_cut(smoothed, ring, knots, torus, parameters)
    height = keep_largest_regions(surface.faces, height)
    if not (height < 0).any() or not (height >= 0).any():
        raise TopologyError("the cut leaves nothing on one side of it; move the cut height back")
    right, left = _tidy_caps(surface.faces, right, left, height)
    vertices, faces, piece = _divide(surface, right, left, height)
    vertices, faces, piece = _split_chords(vertices, faces, piece)
    dissection = Dissection(SurfaceMesh(vertices, faces), piece.astype(np.int64), knots)
    _check(dissection)
    return dissection


def _ring_of_oesophagus(torus: Torus, surface: SurfaceMesh) -> Booleans:
    """Return the vertices around the narrowest place of the oesophagus."""
    away = np.asarray(cKDTree(torus.membrane).query(surface.vertices)[0])
    return np.asarray(away <= max(float(away.min()), RING_REACH * torus.pitch))


def _height_over_cut(
    smoothed: Floats, ring: Booleans, knots: Floats, torus: Torus, parameters: CutParameters
) -> Floats:
    """Return how far behind the cut each smoothed vertex lies, micrometres.

    Near the oesophagus the cut follows its narrowest ring, which may be tilted, so that it runs
    around the tunnel whatever way that takes; away from it the cut is straight between the knots.
    """
    frame = torus.frame
    across = smoothed[:, [frame.left_right, frame.dorso_ventral]]
    away, nearest = cKDTree(across[ring]).query(across)
    nearness = np.exp(-((away / (RING_INFLUENCE * torus.oesophagus.width_um)) ** 2))
    straight = np.interp(smoothed[:, frame.left_right], knots[:, 0], knots[:, 1])
    at_ring = smoothed[ring][nearest, frame.antero_posterior] + parameters.shift_um
    cut = nearness * at_ring + (1 - nearness) * straight
    return np.asarray(smoothed[:, frame.antero_posterior] - cut)


def _tidy_caps(
    faces: Integers, right: Floats, left: Floats, height: Floats
) -> tuple[Floats, Floats]:
    """Return the caps' fields changed so that the cut crosses each rim exactly twice.

    What the cut severs from either part of a cap joins the tube, and what a cap severs from either
    half of the tube joins the nearer cap.
    """
    fields = [right.copy(), left.copy()]
    is_behind = height >= 0
    for field in fields:
        for side in (is_behind, ~is_behind):
            severed = all_but_largest(faces, (field < 0) & side)
            field[severed] = -field[severed]
    is_tube = (fields[0] >= 0) & (fields[1] >= 0)
    for side in (is_behind, ~is_behind):
        severed = all_but_largest(faces, is_tube & side)
        for field, other in (fields, fields[::-1]):
            joins = severed & (field < other)
            field[joins] = -field[joins] - SMALL
    return keep_largest_regions(faces, fields[0]), keep_largest_regions(faces, fields[1])


def _divide(
    surface: SurfaceMesh, right: Floats, left: Floats, height: Floats
) -> tuple[Floats, Integers, Integers]:
    """Split the surface where each field is zero; return it with the piece of each face."""
    faces = surface.faces
    fields = np.column_stack([surface.vertices, right, left, height])
    cap = np.zeros(len(faces), dtype=np.int64)  # 0 tube, 2 right cap, 3 left cap: as in PIECES
    for column, number in ((3, 2), (4, 3)):
        refinement = split_along_zero(faces, fields[:, column])
        is_cap = ~refinement.sides(fields[:, column])
        cap = np.where(is_cap, number, cap[refinement.parent])
        fields, faces = refinement.carry(fields), refinement.faces
    fields[:, 5] = _tidy_height(faces, cap, fields[:, 5])
    refinement = split_along_zero(faces, fields[:, 5])
    is_behind = refinement.sides(fields[:, 5])
    cap = cap[refinement.parent]
    return refinement.carry(fields)[:, :3], refinement.faces, np.where(cap > 0, cap, is_behind)


def _tidy_height(faces: Integers, cap: Integers, height: Floats) -> Floats:
    """Return heights whose two signs occupy one connected region each in the tube and in each cap.

    Vertices on a rim belong to two of these, so changes for one may call for some in another.
    """
    height = height.copy()
    for _ in range(TIDYING_ROUNDS):
        for number in (0, 2, 3):
            own = faces[cap == number]
            is_own = np.zeros(len(height), dtype=bool)
            is_own[own] = True
            for is_behind in (True, False):
                severed = all_but_largest(own, is_own & ((height >= 0) == is_behind))
                height[severed] = -height[severed] - (SMALL if is_behind else 0)
    return height


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
