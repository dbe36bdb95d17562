"""The same anatomical place in two brains: how the source lies and is trimmed as the target is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from flyreg_core.alignment import OWN, Alignment
from flyreg_core.cut import PIECES, Dissection
from flyreg_core.frame import LEFT_RIGHT, BrainFrame
from flyreg_core.landmarks import HALVES
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.project import Brain, Role
from flyreg_core.shape_map import ShapeMap
from flyreg_core.skin import NORMAL_UM
from flyreg_core.solid import VoxelSolid, close_solid
from flyreg_core.torus import CLOSING, ORIGINS, Torus
from flyreg_core.trim import TrimPlanes


@dataclass(frozen=True, eq=False)
class CarriedCut:
    """The cut of a target, looked up from the source."""

    to_target: ShapeMap
    outwards: float  # see `BrainFrame.outwards`, of the source
    height: Floats  # (n,), of the target's vertices behind its cut along the surface, micrometres
    tree: KDTree  # of positions and weighted normals of these vertices

    def height_over_cut(self, surface: SurfaceMesh) -> Floats:
        """Return (n,) how far behind the cut the vertices of a source come to lie, micrometres."""
        normals = self.to_target.turned(surface.vertices, self.outwards * surface.vertex_normals)
        places = np.hstack([self.to_target(surface.vertices), NORMAL_UM * normals])
        return np.asarray(self.height[self.tree.query(places)[1]])


@dataclass(frozen=True, eq=False)
class Match:
    """What the target decides about a source that the user left open."""

    frame: BrainFrame  # of the source
    planes: TrimPlanes | None  # where the target's planes come to lie; None: found by itself
    cut: CarriedCut | None
    grid_runs_right: bool  # see `Torus`: the faces of both brains have the same pattern


def who_decides(source: Brain, target: Brain) -> Role | None:
    """Return the one brain of which the user has said where it is trimmed or cut; None: not one."""
    has_source, has_target = (_is_decided(brain) for brain in (source, target))
    if has_source == has_target:
        return None
    return "source" if has_source else "target"


def share_of_pockets(solid: VoxelSolid) -> float:
    """Return which share of a brain's volume is pockets and cracks that the preparation closes.

    Of two brains the one with fewer is laid flat by itself, and the other one as it is: what has no
    partner is then filled, not to be squeezed in. It is the same brain whichever of them is the
    source, so both directions of a registration are one map.
    """
    closed = close_solid(solid, CLOSING[0])
    return 1 - float(np.count_nonzero(solid.inside)) / float(np.count_nonzero(closed.inside))


def _is_decided(brain: Brain) -> bool:
    usual = Brain(brain.input)
    return (brain.trim, brain.handles, brain.cut) != (*(usual.trim, usual.handles, usual.cut),)


def match_to_target(
    own: BrainFrame,
    target: Torus,
    dissection: Dissection,
    alignment: Alignment,
    to_target: ShapeMap | None,
) -> Match:
    """Return how a source lies, and where it is trimmed and cut, as its target is.

    The source keeps its own frame where the alignment found nothing better: which way a brain is
    tilted its own shape tells best.

    Parameters
    ----------
    own : BrainFrame
        The source's frame by its own shape.
    to_target : ShapeMap, optional
        Without it the source is trimmed and cut by its own shape alone.
    """
    frame = own if alignment.candidates[0].signs == OWN else alignment.frame
    if to_target is None:
        return Match(frame, None, None, target.grid_runs_right)
    inside = target.frame.coordinates(target.surface.vertices)
    is_cap = target.origin_of_vertex == ORIGINS.index("trimmed")
    is_left = inside[:, LEFT_RIGHT] > (target.planes.right + target.planes.left) / 2
    caps = (to_target.back(target.surface.vertices[is_cap & side]) for side in (~is_left, is_left))
    right, left = (float(frame.coordinates(cap)[:, LEFT_RIGHT].mean()) for cap in caps)
    planes = TrimPlanes(right, left)
    cut = _carried_cut(dissection, target.frame, to_target, frame)
    return Match(frame, planes, cut, target.grid_runs_right)


def _carried_cut(
    target: Dissection, target_frame: BrainFrame, to_target: ShapeMap, source_frame: BrainFrame
) -> CarriedCut:
    surface, piece = target.surface, target.piece_of_face
    on_half = np.zeros((len(HALVES), len(surface.vertices)), dtype=bool)
    for number, half in enumerate(HALVES):
        on_half[number, surface.faces[piece == PIECES.index(half)]] = True
    seam = surface.vertices[on_half.all(axis=0)]
    is_known = on_half.any(axis=0)
    vertices = surface.vertices[is_known]
    away = KDTree(seam).query(vertices)[0]
    height = np.where(on_half[1, is_known], away, -away)
    normals = target_frame.outwards * surface.vertex_normals[is_known]
    features = np.hstack([vertices, NORMAL_UM * normals])
    return CarriedCut(to_target, source_frame.outwards, height, KDTree(features))
