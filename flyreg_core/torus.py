"""Stage 2: the main brain as one closed surface with exactly one handle."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace

import numpy as np
import scipy
from scipy.spatial import cKDTree

from flyreg_core.errors import TopologyError
from flyreg_core.flatten import Springs, solve_means
from flyreg_core.frame import LEFT_RIGHT, BrainFrame
from flyreg_core.handles import (
    Carving,
    Handle,
    HandleParameters,
    Point,
    as_point,
    drill,
    find_thinnest_channel,
    open_oesophagus,
)
from flyreg_core.isosurface import extract_surface_and_voxels
from flyreg_core.mesh import Booleans, Floats, Integers, SurfaceMesh
from flyreg_core.pockets import DEPTH, below_lids, fill_pockets, pocket_depths
from flyreg_core.pose import leans_right
from flyreg_core.progress import Report, within
from flyreg_core.side_by_side import both
from flyreg_core.solid import VoxelSolid, close_solid, kuhn_structure
from flyreg_core.surface_distance import distances_to_surface
from flyreg_core.topology import unique_edges
from flyreg_core.trim import TrimParameters, TrimPlanes, find_trim_planes, plane_depth, trim

CLOSING = (1.5, 1.0)
"""Radii by which cracks are closed, voxels; the next is tried where one closes the oesophagus."""
SMALLEST_DEPTH = 0.05
"""Depth given to a voxel that lies on the other side of the original surface, in voxels."""
ORIGINS = ("original", "filled", "drilled", "trimmed", "bridged")
"""Where a vertex of a prepared surface comes from; bridged is where the original is open."""
LEAST_JUMP = 0.5
"""Where the winding number changes by less from voxel to voxel, there is no original surface."""
GUESSED_CHANNEL = "drilled through the thinnest place of the midline"
ROUNDS = 3
"""How often vertices step back to the original surface."""
FARTHEST_STEP = 1.0
"""How far a vertex may step back, voxels."""
LEAST_UPRIGHT = 0.3
"""Cosine by which a face may turn at most when its vertices step back."""


@dataclass(frozen=True)
class Filling:
    """One place where volume was added, to close a crack, a hollow or another tunnel."""

    center_um: Point
    volume_um3: float


@dataclass(frozen=True, eq=False)
class Torus:
    """The main brain: closed, one component, one handle."""

    surface: SurfaceMesh  # faces counter-clockwise seen from outside, in the animal's frame
    frame: BrainFrame
    planes: TrimPlanes
    pitch: float  # edge of the voxels it was drawn from, micrometres
    handles: tuple[Handle, ...]  # widest first, exactly one of them the oesophagus
    chosen_by: str  # why that one is taken for the oesophagus
    is_guess: bool
    membrane: Floats  # (k, 3), points that span the oesophagus at its narrowest place, micrometres
    turn: Floats  # (n,), see `turns_around_the_oesophagus`
    origin_of_vertex: Integers  # (n,), index into ORIGINS
    fillings: tuple[Filling, ...]  # the largest first
    drilled_um3: float
    grid_runs_right: bool = False  # whether its voxels were counted from left to right

    @property
    def oesophagus(self) -> Handle:
        """The handle that was kept open."""
        return next(handle for handle in self.handles if handle.is_oesophagus)

    def nearest_vertices(self, vertices: Floats) -> Integers:
        """Return for each of (k, 3) vertices the number of the nearest of the torus' own."""
        if vertices is self.surface.vertices:
            return np.arange(len(vertices))
        return np.asarray(cKDTree(self.surface.vertices).query(vertices)[1], dtype=np.int64)

    def mirrored(self) -> Torus:
        """Return the same in a frame with left and right exchanged."""
        surface = SurfaceMesh(self.surface.vertices, self.surface.faces[:, ::-1])
        frame, planes = self.frame.mirrored(), self.planes.mirrored()
        return replace(self, surface=surface, frame=frame, planes=planes)

    @property
    def filled_um3(self) -> float:
        """Volume that was added, cubic micrometres."""
        return sum(filling.volume_um3 for filling in self.fillings)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know about the choice of the handle, a sentence each."""
        if not self.is_guess:
            return ()
        place = ", ".join(f"{x:.0f}" for x in self.oesophagus.center_um)
        return (
            f"the oesophagus is a guess: the tunnel at ({place}) um, {self.oesophagus.width_um:.0f} um "
            f"wide, {self.chosen_by}; point at the right one, or drill it, if this is wrong",
        )


def make_torus(
    original: SurfaceMesh,
    solid: VoxelSolid,
    trimming: TrimParameters,
    handles: HandleParameters,
    report: Report,
    grid_runs_right: bool | None = None,
) -> Torus:
    """Return the main brain of a solid: trimmed, carved to one handle, drawn as a closed surface.

    Parameters
    ----------
    original : SurfaceMesh
        What the solid was made from; the new vertices lie on it, but where something was filled,
        drilled or trimmed.
    grid_runs_right : bool, optional
        Whether to count the voxels from left to right; found if not given.

    Raises
    ------
    MeshError, TopologyError
        See `trim.trim` and `handles.open_oesophagus`.

    Notes
    -----
    The Kuhn grid is not its own mirror image. So that a brain and its mirror image become mirror
    images, the grid is counted towards the side that reaches farther, whichever that is.
    """
    is_turned = leans_right(original, solid.frame) if grid_runs_right is None else grid_runs_right
    if is_turned:
        trimming = trimming.mirrored()
        torus = _make_torus(original, solid.mirrored(), trimming, handles, report).mirrored()
        return replace(torus, grid_runs_right=True)
    return _make_torus(original, solid, trimming, handles, report)


def _make_torus(
    original: SurfaceMesh,
    solid: VoxelSolid,
    trimming: TrimParameters,
    handles: HandleParameters,
    report: Report,
) -> Torus:
    whole = close_solid(solid, CLOSING[0])
    planes = find_trim_planes(whole, trimming)
    (carving, closed, handles), depths = both(
        lambda: _carve_open(solid, whole, planes, handles, within(report, 0.0, 0.4)),
        lambda: pocket_depths(solid.inside),
    )
    drilled = drill(solid, handles)
    is_main = (plane_depth(solid, planes) > 0)[:, None, None]
    filled = fill_pockets(carving, closed, drilled, depths, is_main, within(report, 0.4, 0.5))
    is_membrane = filled.inside & ~closed.inside & (depths <= DEPTH)
    lids = below_lids(filled, depths)
    field = _depth(original, filled, is_membrane, lids, planes, within(report, 0.5, 0.8))
    drawn, voxels = extract_surface_and_voxels(field, solid.origin, solid.pitch)
    origins = _origins(solid, drilled, filled, planes, voxels)
    rough = SurfaceMesh(solid.frame.points(drawn.vertices), drawn.faces)
    surface, turns = both(
        lambda: _return_to_original(rough, origins == 0, original, solid.pitch, report),
        lambda: turns_around_the_oesophagus(rough.faces, carving, voxels[:, 1]),
    )
    return Torus(
        surface,
        solid.frame,
        planes,
        solid.pitch,
        carving.handles,
        carving.chosen_by,
        carving.is_guess,
        solid.positions(np.nonzero(carving.membrane)),
        turns,
        origins,
        _fillings(replace(solid, inside=filled.inside & ~solid.inside)),
        float((solid.inside & ~drilled.inside).sum()) * solid.pitch**3,
    )


def _fillings(filled: VoxelSolid) -> tuple[Filling, ...]:
    labels, count = scipy.ndimage.label(filled.inside, kuhn_structure())
    numbers = np.arange(1, count + 1)
    if not count:
        return ()
    centers = np.array(scipy.ndimage.center_of_mass(filled.inside, labels, numbers))
    volumes = np.bincount(labels.reshape(-1))[1:] * filled.pitch**3
    places = filled.frame.points(filled.origin + filled.pitch * centers)
    order = np.argsort(-volumes, kind="stable")
    return tuple(Filling(as_point(places[k]), float(volumes[k])) for k in order)


def _carve_open(
    solid: VoxelSolid,
    whole: VoxelSolid,
    planes: TrimPlanes,
    handles: HandleParameters,
    report: Report,
) -> tuple[Carving, VoxelSolid, HandleParameters]:
    """Close cracks as far as leaves the oesophagus open, and carve; `whole` is closed the most.

    Raw surfaces have sheets inside the brain whose hollows reach the outside through cracks; such
    pockets are not anatomy and would flatten to nothing. Where that leaves no oesophagus and the
    user said nothing, a channel is drilled if there is a thin place for it, and told to be a guess.
    """
    for radius in CLOSING:
        crackless = whole if radius == CLOSING[0] else close_solid(solid, radius)
        closed = trim(drill(crackless, handles), planes)
        with contextlib.suppress(TopologyError):
            return open_oesophagus(closed, handles, report), closed, handles
    whole = trim(whole, planes)
    channel = None if handles.is_decided else find_thinnest_channel(whole)
    if channel is not None:
        guess = replace(handles, drills=(channel,))
        carving = open_oesophagus(drill(whole, guess), guess, report)
        return replace(carving, chosen_by=GUESSED_CHANNEL, is_guess=True), whole, guess
    closed = trim(drill(solid, handles), planes)
    return open_oesophagus(closed, handles, report), closed, handles


def _depth(
    original: SurfaceMesh,
    solid: VoxelSolid,
    is_membrane: Booleans,
    lids: Floats,
    planes: TrimPlanes,
    report: Report,
) -> Floats:
    """Return how deep each voxel near the surface lies inside, micrometres; negative outside.

    The sign is the label's, always; the size is the distance to the original surface or to a
    trim plane, so that the surface passes where the original does, or to the lid of a pocket.
    """
    inside, structure = solid.inside, kuhn_structure()
    near = scipy.ndimage.binary_dilation(inside, structure) & ~scipy.ndimage.binary_erosion(
        inside, structure
    )
    index = np.nonzero(near)
    positions = solid.positions(index)
    to_surface, to_lid = distances_to_surface(positions, original, report), lids[index]
    to_surface = np.where(
        inside[index],
        np.where(to_lid > 0, to_lid, to_surface),
        np.where(to_lid < 0, np.minimum(to_surface, -to_lid), to_surface),
    )
    depth_in_planes = plane_depth(solid, planes)[index[LEFT_RIGHT]]
    size = np.where(
        inside[index],
        np.minimum(to_surface, depth_in_planes),
        np.where(depth_in_planes > 0, to_surface, np.maximum(-depth_in_planes, 0)),
    )
    size[is_membrane[index]] = 0
    size = np.clip(size, SMALLEST_DEPTH * solid.pitch, None)
    field = np.where(inside, solid.pitch, -solid.pitch)
    field[index] = np.where(inside[index], size, -size)
    return np.asarray(field)


def _origins(
    solid: VoxelSolid, drilled: VoxelSolid, carved: VoxelSolid, planes: TrimPlanes, voxels: Integers
) -> Integers:
    """Return where each vertex, drawn between a voxel inside and one outside, comes from."""
    filled = (carved.inside & ~solid.inside).reshape(-1)[voxels[:, 0]]
    channel = (solid.inside & ~drilled.inside).reshape(-1)[voxels[:, 1]]
    outer = np.unravel_index(voxels[:, 1], solid.inside.shape)
    beyond = plane_depth(solid, planes)[outer[LEFT_RIGHT]] <= 0
    bridged = np.zeros(len(voxels), dtype=bool)
    if solid.winding_number is not None:
        jump = np.diff(solid.winding_number.reshape(-1)[voxels], axis=1)[:, 0]
        bridged = np.abs(jump) < LEAST_JUMP
    kinds = [beyond, channel, filled, bridged]
    return np.select(kinds, [3, 2, 1, 4], default=0).astype(np.int64)


def _return_to_original(
    surface: SurfaceMesh, may_move: Booleans, original: SurfaceMesh, pitch: float, report: Report
) -> SurfaceMesh:
    """Return the surface with vertices moved onto the original, never turning a face much."""
    movers = np.flatnonzero(may_move)
    for _ in range(ROUNDS):
        report(0.9, "returning to the original surface")
        _, face, barycentric = original.tree.nearest(surface.vertices[movers])
        closest = np.einsum("ij,ijk->ik", barycentric, original.vertices[original.faces[face]])
        step = closest - surface.vertices[movers]
        length = np.linalg.norm(step, axis=1, keepdims=True)
        step *= np.minimum(1, FARTHEST_STEP * pitch / np.maximum(length, 1e-12))
        moved = surface.vertices.copy()
        moved[movers] += step
        surface = _without_turned_faces(surface, moved)
    return surface


def _without_turned_faces(before: SurfaceMesh, moved: Floats) -> SurfaceMesh:
    """Return the surface with its vertices moved, except around faces that this would turn."""
    moved = moved.copy()
    while True:
        after = SurfaceMesh(moved, before.faces)
        along = np.einsum("ij,ij->i", before.face_normals, after.face_normals)
        size = 2 * before.face_areas
        is_upright = along > LEAST_UPRIGHT * size * np.maximum(2 * after.face_areas, 0.1 * size)
        if is_upright.all():
            return after
        back = np.unique(before.faces[~is_upright])
        if np.array_equal(moved[back], before.vertices[back]):
            return after
        moved[back] = before.vertices[back]


def turns_around_the_oesophagus(faces: Integers, carving: Carving, outer: Integers) -> Floats:
    """Return for each vertex how far around it lies on the way through the oesophagus and back.

    Parameters
    ----------
    outer : (n,) int
        The flat index of the voxel outside next to each vertex.

    Returns
    -------
    (n,) float
        In turns, from 0 to 1: 0 in the membrane, growing backwards through the oesophagus, then
        over the back of the brain and its outside to its front.

    Notes
    -----
    A harmonic function with a jump of one turn across the membrane. Harmonic one-forms on a torus
    vanish nowhere (Gortler, Gotsman, Thurston, Discrete one-forms on meshes, CAGD 23, 2006,
    doi:10.1016/j.cagd.2005.05.002), so its level sets are simple closed curves, all around the
    oesophagus, and any two of them cut the torus into two rings.
    """
    in_membrane = carving.membrane.reshape(-1)[outer]
    behind = carving.behind.reshape(-1)[outer]
    edges, _ = unique_edges(faces)
    backwards, forwards = (
        in_membrane[edges[:, a]] & behind[edges[:, b]] for a, b in ((0, 1), (1, 0))
    )
    jumps = backwards.astype(np.int64) - forwards.astype(np.int64)
    is_fixed = np.zeros(len(outer), dtype=bool)
    is_fixed[0] = True
    nothing = np.zeros(len(outer))
    turn, _ = solve_means(Springs(edges, jumps, np.ones(len(edges))), is_fixed, nothing, nothing)
    return np.asarray((turn - turn[in_membrane].mean()) % 1.0)
