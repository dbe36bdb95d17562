"""Landmark pairs: the same place on both brains, and how strongly it pulls."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from flyreg_core.errors import LandmarkError

HalfName = Literal["anterior", "posterior"]
CurveName = Literal["upper", "lower", "left", "right", "hole"]
Kind = Literal["upper", "lower", "left", "right", "hole", "interior"]
Place = float | tuple[float, float, float]

Pairing = Literal["shape", "coordinate", "arc length", "nearest"]

HALVES: tuple[HalfName, HalfName] = ("anterior", "posterior")
CURVES: tuple[CurveName, ...] = ("upper", "lower", "left", "right", "hole")
SHARED_CURVES: tuple[CurveName, ...] = ("upper", "lower", "hole")
"""The curves along which the two halves meet; left and right belong to one half each."""
SUGGESTED = "suggested "
"""How the names of suggestions begin."""
CORNERS = tuple(
    f"corner-{curve}-{side}" for curve in ("upper", "lower") for side in ("right", "left")
)
"""Ids of the pairs at the corners of the rectangle, which hold it in place when others play solo."""


@dataclass(frozen=True)
class LandmarkPair:
    """One named place on the source and on the target.

    A place is a share of the arc length (0 to 1) of a boundary curve, or for `interior` a point
    on the surface in micrometres. Upper and lower run from the right corner to the left one, left
    and right from the upper corner to the lower one, the hole once around from its top towards the
    animal's left.
    """

    id: str  # stable, unique in a project
    name: str
    kind: Kind
    half: HalfName | None  # None: on a curve that both halves share, or interior
    source: Place | None  # None: not placed yet
    target: Place | None
    weight: float = 1.0  # 0: not used
    origin: Literal["boundary", "suggested", "user"] = "user"
    color: tuple[int, int, int] | None = None  # red, green, blue, 0 to 255; None: that of its kind

    def __post_init__(self) -> None:
        if not (math.isfinite(self.weight) and self.weight >= 0):
            raise LandmarkError(
                f"the weight of landmark {self.name} must be 0 or a positive number, not {self.weight}"
            )
        for place in (self.source, self.target):
            if place is not None and isinstance(place, float) == (self.kind == "interior"):
                raise LandmarkError(f"landmark {self.name} is {self.kind} but lies at {place}")

    @property
    def short_name(self) -> str:
        """The name, without saying that it is only suggested."""
        return self.name.removeprefix(SUGGESTED)

    @property
    def is_placed(self) -> bool:
        """Tell whether both ends are known."""
        return self.source is not None and self.target is not None


LEAST_GAP = 1e-3
"""Landmarks of one curve stay so far apart, as a share of it."""


def kept_in_order(share: float, pair: LandmarkPair, others: Iterable[LandmarkPair]) -> float:
    """Return the target share of a pair on a curve nearest to `share` that passes no neighbour.

    Others on the same curve follow each other on the target as they do on the source, so that
    the curve is not turned round anywhere.
    """
    start, end = pair.source, pair.target
    if not (isinstance(start, float) and isinstance(end, float)):
        return share
    ways = [
        (other.source - start, other.target - end)
        for other in others
        if (other.kind, other.half) == (pair.kind, pair.half)
        and other.id != pair.id
        and isinstance(other.source, float)
        and isinstance(other.target, float)
    ]
    if pair.kind == "hole":  # closed: the next one is a neighbour either way
        ways = [(ahead % 1.0, gap % 1.0) for ahead, gap in ways]
        ways += [(ahead - 1.0, gap - 1.0) for ahead, gap in ways]
        way = (share - end + 0.5) % 1.0 - 0.5
    else:
        ways += [(-2.0, -end - LEAST_GAP), (2.0, 1.0 - end + LEAST_GAP)]
        way = share - end
    _, after = min(((ahead, gap) for ahead, gap in ways if ahead > 0), default=(1.0, 1.0))
    _, before = max(((ahead, gap) for ahead, gap in ways if ahead < 0), default=(-1.0, -1.0))
    moved = end + min(max(way, before + LEAST_GAP), after - LEAST_GAP)
    return moved % 1.0 if pair.kind == "hole" else moved


@dataclass(frozen=True)
class LandmarkParameters:
    """Which landmark pairs the program makes, on the boundary curves and inside.

    `pairing` says which places of a curve belong together: those that shape tells ("shape": the
    source is trimmed, cut and laid flat as the target is), or else, each brain by itself, those at
    the same share of the way along the animal's axis that the curve follows ("coordinate"), at the
    same share of arc length ("arc length"), or each source vertex with the nearest target vertex in
    the flat domain ("nearest", the paper's choice).
    """

    per_seam: int = 9  # between the corners of upper and of lower, and around the hole
    per_side: int = 3  # between the corners of left and of right, in each half
    pairing: Pairing = "shape"
    per_half: int = 60  # suggested by shape inside each half

    @property
    def is_by_shape(self) -> bool:
        """Tell whether the shapes of both brains decide what belongs together."""
        return self.pairing == "shape"
