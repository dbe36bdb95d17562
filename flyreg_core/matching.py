"""The same anatomical place in two brains: how the source lies, is trimmed and cut as the target is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flyreg_core.alignment import Alignment
from flyreg_core.cut import Dissection
from flyreg_core.frame import ANTERO_POSTERIOR, LEFT_RIGHT, BrainFrame
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.torus import ORIGINS, Torus
from flyreg_core.trim import TrimParameters

FARTHEST = 0.95
"""How far towards the side of the source a plane may be carried, as a share of the way there."""


@dataclass(frozen=True, eq=False)
class Match:
    """What the target decides about a source that the user left open."""

    frame: BrainFrame  # of the source
    trim: TrimParameters
    cut_knots: Floats  # (3, 2), as in `Dissection`, in the frame of the source


def match_to_target(
    source: SurfaceMesh, target: Torus, dissection: Dissection, alignment: Alignment
) -> Match:
    """Return the target's frame, trim planes and cut, carried to the source by an affine map.

    Source and target must be trimmed and cut at the same anatomical place, or what lies on one half
    of the one lies on the other half of the other. Where a plane would miss the source (it lacks an
    optic lobe that the target has), it stops just before its side.
    """
    frame, back = alignment.frame, alignment.to_target.inverse()
    inside = target.frame.coordinates(target.surface.vertices)
    is_cap = target.origin_of_vertex == ORIGINS.index("trimmed")
    is_left = inside[:, LEFT_RIGHT] > (target.planes.right + target.planes.left) / 2
    caps = [inside[is_cap & side].mean(axis=0) for side in (~is_left, is_left)]
    middle = np.array([0.0, inside[:, 1].mean(), 0.0])
    places = np.stack([caps[0], middle, caps[1]])
    places[:, [LEFT_RIGHT, ANTERO_POSTERIOR]] = dissection.cut_knots
    planes = np.stack(caps)
    planes[:, LEFT_RIGHT] = target.planes.right, target.planes.left
    carried, knots = (
        frame.coordinates(back(target.frame.points(points))) for points in (planes, places)
    )
    sides = frame.coordinates(source.vertices)[:, LEFT_RIGHT]
    right = max(float(carried[0, LEFT_RIGHT]), FARTHEST * float(sides.min()))
    left = min(float(carried[1, LEFT_RIGHT]), FARTHEST * float(sides.max()))
    trim = TrimParameters(right, left)
    return Match(frame, trim, knots[:, [LEFT_RIGHT, ANTERO_POSTERIOR]])
