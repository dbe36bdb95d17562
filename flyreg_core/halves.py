"""The two halves laid flat, each with its boundaries and its picture in the rectangle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from flyreg_core.boundary import Curve, CurveKey, curve_key
from flyreg_core.cut import Dissection
from flyreg_core.flatten import FlattenParameters, Ring, Springs, flatten
from flyreg_core.frame import DORSO_VENTRAL, LEFT_RIGHT, BrainFrame
from flyreg_core.landmarks import CurveName, HalfName
from flyreg_core.mesh import Booleans, FlatMesh, Floats, Integers, SurfaceMesh
from flyreg_core.progress import Report
from flyreg_core.rectangle import (
    STARTS,
    RadialLaw,
    from_plane,
    perimeter_share,
    radial_law,
    to_plane,
    u_of_perimeter,
    wrapped,
)
from flyreg_core.strip_warp import Fading, find_fading
from flyreg_core.topology import compacted
from flyreg_core.unfold import Net

T = TypeVar("T", bound=np.generic)
OUTER_CURVES: tuple[CurveName, ...] = ("upper", "left", "lower", "right")


@dataclass(frozen=True, eq=False)
class FlatHalf:
    """One half: its vertices in the whole surface, on the strip and in the rectangle."""

    name: HalfName
    vertex_of: Integers  # (k,), numbers in the whole surface
    flat: FlatMesh
    springs: Springs
    law: RadialLaw
    outer: Integers  # (b,), own numbers, once around clockwise as seen from the front
    outer_share: Floats  # (b,), shares of the rectangle's perimeter, growing
    hole: Integers  # (c,)
    hole_share: Floats  # (c,)

    @property
    def faces(self) -> Integers:
        """(m, 3) faces over the half's own vertices."""
        return self.flat.faces

    @cached_property
    def is_boundary(self) -> Booleans:
        """(k,) vertices on the outer boundary or on the hole."""
        result = np.zeros(len(self.vertex_of), dtype=bool)
        result[self.outer] = result[self.hole] = True
        return result

    @cached_property
    def net(self) -> Net:
        """What holds the half flat."""
        return Net(self.springs, self.faces)

    @cached_property
    def fadings(self) -> tuple[Fading, Fading]:
        """How each vertex goes along with the outer boundary and with the hole."""
        u = self.flat.uv[:, 0]
        return find_fading(u, self.outer, self.beta), find_fading(u, self.hole, 1 - self.beta)

    @cached_property
    def beta(self) -> Floats:
        """(k,) share of the way from the hole to the outside."""
        return self.law.beta(self.flat.uv[:, 1])

    @cached_property
    def plane(self) -> Floats:
        """(k, 2) places in the rectangle, as seen from outside the brain, y up."""
        return to_plane(self.flat.uv[:, 0], self.beta)


def with_hole_as_seen(
    halves: Mapping[HalfName, FlatHalf],
    curves: Mapping[CurveKey, Curve],
    surface: SurfaceMesh,
    frame: BrainFrame,
) -> tuple[dict[HalfName, FlatHalf], Mapping[CurveKey, Curve]]:
    """Return halves and curves with the hole turned so that directions are as seen from the front.

    How the hole lies in the rectangle so follows from all that surrounds it and not from its rim
    alone, which is short and differs from brain to brain. The turn is the least squares fit of
    u + turn (1 - v), which solves the same equations, to the direction in which each vertex is seen
    from the middle of the hole.
    """
    hole = curves["hole", None]
    middle = frame.coordinates(hole.points[:-1]).mean(axis=0)
    sense = {half: 1.0 if half == "anterior" else -1.0 for half in halves}
    turns = []
    for name, half in halves.items():
        arm = frame.coordinates(surface.vertices[half.vertex_of]) - middle
        seen, _ = from_plane(arm[:, [LEFT_RIGHT, DORSO_VENTRAL]] * [1.0, -1.0])
        u, nearness = half.flat.uv[:, 0], 1 - half.flat.uv[:, 1]
        away = wrapped(u_of_perimeter(name, seen) - u)
        turns.append(sense[name] * float(nearness @ away / (nearness @ nearness)))
    turn = float(np.mean(turns))
    share = hole.share + turn / STARTS["hole"][1]
    turned = {}
    for name, half in halves.items():
        uv = half.flat.uv.copy()
        uv[:, 0] += sense[name] * turn * (1 - uv[:, 1])
        turned[name] = replace(
            half,
            flat=replace(half.flat, uv=uv),
            hole_share=perimeter_share("hole", share[:-1]),
        )
    return turned, {**curves, ("hole", None): replace(hole, share=share)}


def lay_flat(
    dissection: Dissection,
    curves: Mapping[CurveKey, Curve],
    half: HalfName,
    parameters: FlattenParameters,
    report: Report,
) -> FlatHalf:
    """Return one half laid flat, its five curves at their places by arc length (3.1 D)."""
    faces, vertex_of = compacted(dissection.faces_of(half))
    own_number = np.full(len(dissection.surface.vertices), -1)
    own_number[vertex_of] = np.arange(len(vertex_of))
    outer = along_outer(half, {key: curve.vertices for key, curve in curves.items()})
    outer_share = along_outer(
        half, {key: perimeter_share(key[0], curve.share) for key, curve in curves.items()}
    )
    hole_curve = curves["hole", None]
    hole, hole_share = hole_curve.vertices[:-1], perimeter_share("hole", hole_curve.share[:-1])
    outer, hole = own_number[outer], own_number[hole]
    turn = slice(None) if half == "anterior" else slice(None, None, -1)
    ring = Ring(
        faces,
        outer[turn],
        u_of_perimeter(half, outer_share)[turn],
        hole[turn],
        u_of_perimeter(half, hole_share)[turn],
    )
    surface = SurfaceMesh(dissection.surface.vertices[vertex_of], faces)
    flat, springs = flatten(ring, surface.face_areas, parameters, report, surface.vertices)
    law = radial_law(flat.uv[:, 1], surface.vertex_areas)
    return FlatHalf(half, vertex_of, flat, springs, law, outer, outer_share, hole, hole_share)


def along_outer(half: HalfName, values: Mapping[CurveKey, NDArray[T]]) -> NDArray[T]:
    """Return values given along each curve once around the outside, clockwise from the front."""
    parts = []
    for name in OUTER_CURVES:
        part = values[curve_key(name, half)]
        parts.append((part if name in ("upper", "left") else part[::-1])[:-1])
    return np.concatenate(parts)
