"""Stage 4: the main brain into two caps and two halves, with the cuts as edges of the mesh.

The caps are what the trim planes left flat. The rest is a tube, which a surface across the axis
of the oesophagus divides into an anterior and a posterior half, each a ring around the hole.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from flyreg_core.cut_height import CutParameters, find_cut_knots, height_over_cut
from flyreg_core.errors import TopologyError
from flyreg_core.frame import LEFT_RIGHT
from flyreg_core.mesh import Booleans, Floats, Integers, SurfaceMesh
from flyreg_core.refine import (
    Refinement,
    chords,
    keep_largest_regions,
    side_keys,
    split_along_zero,
    split_edges,
)
from flyreg_core.relabel import Links, find_links, grow_patch, may_change, move_border
from flyreg_core.smooth import averaging_matrix
from flyreg_core.topology import (
    euler_characteristic,
    euler_characteristic_of,
    is_among,
    unique_edges,
)
from flyreg_core.torus import Torus

PIECES = ("anterior", "posterior", "right cap", "left cap")
CAP_DEPTH = 0.3
"""How far inside a trim plane the cap ends, in voxels of the torus."""
SHORTENING_ROUNDS, SPREADING_PASSES = 4, 40
"""How often the border of the halves is shortened, and how far each side spreads for that."""
LEVELS = np.linspace(0.02, 0.98, 49)
"""Shares of the surface behind the levels at which the first two rings may part."""
SHARES_OF_SHIFT = (1.0, 0.75, 0.5)
"""How much of a shift is tried, in turn."""
STEPS_BESIDE = (0.0, 0.5, -0.5, 1.0, -1.0, 1.5, -1.5, 2.0, -2.0)
"""How far beside another brain's cut is tried, in turn, voxels of the torus."""
SMALL = 1e-9
"""Least size of a value whose sign tells the side."""


@dataclass(frozen=True, eq=False)
class Dissection:
    """The main brain with its cuts drawn: the same surface, refined along them."""

    surface: SurfaceMesh
    piece_of_face: Integers  # (m,), index into PIECES
    cut_knots: Floats  # (3, 2), left-right and antero-posterior place of the cut in the frame
    shift_um: float = 0.0  # how far behind its place the cut was made

    @cached_property
    def own_face(self) -> Integers:
        """(m,) numbers of the faces among those of their pieces."""
        own = np.zeros(len(self.piece_of_face), dtype=np.int64)
        for piece in range(len(PIECES)):
            rows = np.flatnonzero(self.piece_of_face == piece)
            own[rows] = np.arange(len(rows))
        return own

    def faces_of(self, piece: str) -> Integers:
        """Return the faces of one piece, with the vertex numbers of the whole surface."""
        return np.asarray(self.surface.faces[self.piece_of_face == PIECES.index(piece)])


def dissect(
    torus: Torus,
    surface: SurfaceMesh,
    smoothed: Floats,
    parameters: CutParameters,
    carried: Floats | None = None,
) -> Dissection:
    """Return the surface divided into two halves and two caps.

    Parameters
    ----------
    surface : SurfaceMesh
        The torus' surface, simplified or not.
    smoothed : (n, 3) float
        Its vertices after smoothing; they decide which half a vertex belongs to.
    carried : (n,) float, optional
        How far behind the cut of another brain each vertex lies; with it that cut is followed.

    Raises
    ------
    TopologyError
        A cap or the cut lies where there is no brain, wherever the cut is tried.

    Notes
    -----
    Where the cut should run is told by `cut_height`. Two halves that are rings are there from the
    start, parted by two level curves of `Torus.turn`; their border then moves, vertex by vertex, to
    where the cut wants it, as far as they remain rings. The caps grow from where the cut is deepest
    in the trim openings, as far as they remain disks whose rims the cut crosses twice. So every
    brain falls into two rings and two disks, and where the cut is not a height (in folds and
    pockets) it gives way. The lines are drawn between vertices of different sides: simple closed
    curves. A shift that takes the cut out of a trim opening is made only as far as it stays inside;
    a cut that is carried from another brain gives way a little for that.
    """
    problem: TopologyError | None = None
    for shift_um in _shifts(torus, parameters, is_carried=carried is not None):
        try:
            return _dissect(torus, surface, smoothed, shift_um, carried)
        except TopologyError as error:
            problem = problem or error
    raise problem or TopologyError("the cut was not tried")


def _shifts(torus: Torus, parameters: CutParameters, is_carried: bool) -> list[float]:
    """Return how far behind its place the cut is tried, in turn, micrometres."""
    if parameters.shift_um:
        return [share * parameters.shift_um for share in SHARES_OF_SHIFT]
    return [step * torus.pitch for step in STEPS_BESIDE] if is_carried else [0.0]


def _dissect(
    torus: Torus, surface: SurfaceMesh, smoothed: Floats, shift_um: float, carried: Floats | None
) -> Dissection:
    depth = CAP_DEPTH * torus.pitch
    x = torus.frame.coordinates(surface.vertices)[:, LEFT_RIGHT]
    right = _beyond_plane(surface.faces, x - torus.planes.right - depth, "right")
    left = _beyond_plane(surface.faces, torus.planes.left - depth - x, "left")
    turn = torus.turn[torus.nearest_vertices(surface.vertices)]
    knots = find_cut_knots(torus, smoothed, (right < 0, left < 0))
    knots = knots + np.array([0.0, shift_um])
    height = height_over_cut(torus, smoothed, knots) if carried is None else carried - shift_um
    height = keep_largest_regions(surface.faces, height)
    links = find_links(surface.faces, len(surface.vertices))
    is_behind = move_border(links, _rings(surface, turn, height >= 0), height)
    is_behind = _shortened(surface.faces, links, is_behind)
    cap = _grow_caps(surface, links, is_behind, right, left)
    fields = (
        _signed(right, cap == PIECES.index("right cap")),
        _signed(left, cap == PIECES.index("left cap")),
        _signed(height, ~is_behind),
    )
    vertices, faces, piece = _divide(surface, *fields)
    vertices, faces, piece = _split_chords(vertices, faces, piece)
    dissection = Dissection(SurfaceMesh(vertices, faces), piece.astype(np.int64), knots, shift_um)
    _check(dissection)
    return dissection


def _beyond_plane(faces: Integers, inside: Floats, name: str) -> Floats:
    """Return how far inside a trim plane vertices lie, negative in one region without islands."""
    field = keep_largest_regions(faces, inside)
    if not (field < 0).any():
        raise TopologyError(f"the {name} trim plane does not touch the brain; move it inwards")
    return field


def _shortened(faces: Integers, links: Links, is_behind: Booleans) -> Booleans:
    """Return the halves with a border that makes no detours, which would flatten to slivers.

    Each side is spread out a little, and the border moves to where both have spread to.
    """
    averaging = averaging_matrix(faces, len(is_behind))
    for _ in range(SHORTENING_ROUNDS):
        spread = np.where(is_behind, 1.0, -1.0)
        for _ in range(SPREADING_PASSES):
            spread = averaging @ spread
        is_behind = move_border(links, is_behind, spread)
    return is_behind


def _rings(surface: SurfaceMesh, turn: Floats, is_wanted: Booleans) -> Booleans:
    """Return which vertices lie on the posterior of two rings that the torus consists of.

    The posterior ring reaches from the membrane to that level of `Torus.turn` at which it holds the
    most of what is wanted on it and the least of the rest.
    """
    levels = np.quantile(turn[turn > 0], LEVELS)
    gains = [int(np.where(is_wanted, 1, -1)[turn <= level].sum()) for level in levels]
    for level in levels[np.argsort(gains, kind="stable")[::-1]]:
        sides = np.where((turn > 0) & (turn <= level), 1.0, -1.0)
        is_behind = keep_largest_regions(surface.faces, sides) > 0  # no specks of rounding
        if euler_characteristic_of(surface.faces, is_behind) == 0:
            return is_behind
    raise TopologyError(
        "the brain cannot be divided into two rings around its oesophagus; choose another tunnel, "
        "or use more voxels"
    )


def _grow_caps(
    surface: SurfaceMesh, links: Links, is_behind: Booleans, right: Floats, left: Floats
) -> Integers:
    """Return for each vertex the number of its cap in `PIECES`, or 0.

    Each grows from where the cut is deepest in its trim opening.
    """
    vertices, faces = surface.vertices, surface.faces
    if is_behind.all() or not is_behind.any():
        raise TopologyError("the cut leaves nothing on one side of it; move the cut height back")
    seam = _on_outer_seam(faces, links, is_behind, np.minimum(right, left))
    cap = np.zeros(len(is_behind), dtype=np.int64)
    for name, field in (("right", right), ("left", left)):
        number = PIECES.index(f"{name} cap")
        from_rim = cKDTree(vertices[field >= 0]).query(vertices[seam])[0]
        start = seam[np.argmax(np.where(field[seam] < 0, from_rim, -1))]
        if field[start] >= 0 or cap[start]:
            raise TopologyError(
                f"the cut does not pass the {name} trim opening; move the cut height or the plane"
            )
        cap = grow_patch(links, cap, is_behind, field < 0, start, number)
    return cap


def _on_outer_seam(faces: Integers, links: Links, is_behind: Booleans, beyond: Floats) -> Integers:
    """Return vertices at the border of the halves around the outside of the brain.

    Of its two closed curves, the other one runs around the oesophagus; it stays nearer the midline.
    Only vertices that could change side are returned, so that what is left beside them is whole.
    """
    n = len(is_behind)
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    is_seam = is_behind[sides[..., 0]] != is_behind[sides[..., 1]]
    keys, number = np.unique((sides[..., 0] * n + sides[..., 1])[is_seam], return_inverse=True)
    pairs = number.reshape(-1, 2)  # a face with both sides has two edges that are crossed
    graph = sparse.coo_array((np.ones(len(pairs)), tuple(pairs.T)), (len(keys), len(keys)))
    count, curve = connected_components(graph, directed=False)
    edges = np.stack(np.divmod(keys, n), axis=1)
    reach = [float(beyond[edges[curve == k]].min()) for k in range(count)]
    outer = np.unique(edges[curve == int(np.argmin(reach))])
    return outer[may_change(links, is_behind, outer)]


def _signed(values: Floats, is_negative: Booleans) -> Floats:
    """Return values whose signs are as told."""
    size = np.maximum(np.abs(values), SMALL)
    return np.asarray(np.where(is_negative, -size, size))


def _divide(
    surface: SurfaceMesh, right: Floats, left: Floats, height: Floats
) -> tuple[Floats, Integers, Integers]:
    """Split the surface where each field is zero; return it with the piece of each face.

    A vertex on a rim lies on the same side of the cut as the end of its edge outside the cap, so
    that outside the caps the sides are those of the vertices.
    """
    faces = surface.faces
    fields = np.column_stack([surface.vertices, right, left, height])
    cap = np.zeros(len(faces), dtype=np.int64)  # 0 tube, 2 right cap, 3 left cap: as in PIECES
    for column, number in ((3, 2), (4, 3)):
        refinement = split_along_zero(faces, fields[:, column])
        is_cap = ~refinement.sides(fields[:, column])
        cap = np.where(is_cap, number, cap[refinement.parent])
        first, second = refinement.added.ends.T
        outside = np.where(fields[first, column] >= 0, first, second)
        is_anterior = fields[outside, 5] < 0
        fields, faces = refinement.carry(fields), refinement.faces
        rim = slice(len(fields) - len(outside), None)
        fields[rim, 5] = _signed(fields[rim, 5], is_anterior)
    refinement = split_along_zero(faces, fields[:, 5])
    is_behind = refinement.sides(fields[:, 5])
    cap = cap[refinement.parent]
    return refinement.carry(fields)[:, :3], refinement.faces, np.where(cap > 0, cap, is_behind)


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
    edges, counts = unique_edges(faces)
    result = np.zeros(n_vertices, dtype=bool)
    result[edges[counts == 1]] = True
    return result


def _without_whole_faces(edges: Integers, faces: Integers) -> Integers:
    """Leave out one edge of each face that has all three among the edges."""
    n = int(faces.max()) + 1
    key = edges[:, 0] * n + edges[:, 1]
    side_key = side_keys(faces, n)
    whole = is_among(side_key, np.sort(key)).all(axis=1)
    return np.asarray(edges[~is_among(key, np.sort(side_key[whole, 0]))])


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
