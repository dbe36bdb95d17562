"""The same anatomical place in two brains: how the source lies and is trimmed as the target is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flyreg_core.alignment import OWN, Alignment
from flyreg_core.frame import LEFT_RIGHT, BrainFrame
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.torus import ORIGINS, Torus
from flyreg_core.trim import TrimParameters, TrimPlanes

FARTHEST = 0.95
"""How far towards the side of the source a plane may be carried, as a share of the way there."""
SAME_PLACE = 0.15
"""Necks so near to where the target's are carried, as a share of the way there, are the same place."""


@dataclass(frozen=True, eq=False)
class Match:
    """What the target decides about a source that the user left open."""

    frame: BrainFrame  # of the source
    carried: TrimPlanes  # where the target's planes come to lie
    grid_runs_right: bool  # see `Torus`: the faces of both brains have the same pattern

    def trim(self, found: TrimPlanes) -> TrimParameters:
        """Return the planes at the source's own necks where these are the target's, else as carried."""
        return TrimParameters(
            found.right if _is_same_place(found.right, self.carried.right) else self.carried.right,
            found.left if _is_same_place(found.left, self.carried.left) else self.carried.left,
        )


def match_to_target(
    source: SurfaceMesh, own: BrainFrame, target: Torus, alignment: Alignment
) -> Match:
    """Return how a source lies, and where it is trimmed, as its target is.

    The source keeps its own frame where the alignment found nothing better: which way a brain is
    tilted its own shape tells best.

    Parameters
    ----------
    own : BrainFrame
        The source's frame by its own shape.

    Notes
    -----
    Necks are anatomical places that each brain shows itself; they count where both brains show the
    same, which is told after an affine map. Where a plane would miss the source, which may lack an
    optic lobe that the target has, it stops just before its side.
    """
    frame = own if alignment.candidates[0].signs == OWN else alignment.frame
    inside = target.frame.coordinates(target.surface.vertices)
    is_cap = target.origin_of_vertex == ORIGINS.index("trimmed")
    is_left = inside[:, LEFT_RIGHT] > (target.planes.right + target.planes.left) / 2
    caps = np.stack([inside[is_cap & side].mean(axis=0) for side in (~is_left, is_left)])
    caps[:, LEFT_RIGHT] = target.planes.right, target.planes.left
    carried = alignment.to_target.inverse()(target.frame.points(caps))
    right, left = frame.coordinates(carried)[:, LEFT_RIGHT]
    sides = frame.coordinates(source.vertices)[:, LEFT_RIGHT]
    planes = TrimPlanes(
        max(float(right), FARTHEST * float(sides.min())),
        min(float(left), FARTHEST * float(sides.max())),
    )
    return Match(frame, planes, target.grid_runs_right)


def _is_same_place(own: float, carried: float) -> bool:
    return abs(own - carried) <= SAME_PLACE * abs(carried)
