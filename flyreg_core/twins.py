"""The same landmark on the other side of the animal."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from flyreg_core.correspondence import FlatBrain
from flyreg_core.frame import LEFT_RIGHT
from flyreg_core.landmarks import Kind, LandmarkPair, Place
from flyreg_core.surface_places import find_places

OTHER_SIDE: dict[str, str] = {
    "left": "right",
    "right": "left",
    "Left": "Right",
    "Right": "Left",
    "L": "R",
    "R": "L",
}
SIDES = re.compile(r"(?<![A-Za-z])(" + "|".join(OTHER_SIDE) + r")(?![A-Za-z])")
"""A side within a name, standing alone: AL_L, left calyx, tip (R)."""


def twin_of(pair: LandmarkPair, source: FlatBrain, target: FlatBrain) -> LandmarkPair:
    """Return the pair at the mirrored places of both brains, with the name of the other side.

    A place on the surface goes to the place nearest to its mirror image in the animal's midplane; a
    place on a curve to the same curve on the other side.
    """
    kind: Kind = OTHER_SIDE.get(pair.kind, pair.kind)  # type: ignore[assignment]
    return replace(
        pair,
        id=f"{pair.id}-twin",
        name=twin_name(pair.name),
        kind=kind,
        source=_mirrored(pair, pair.source, source),
        target=_mirrored(pair, pair.target, target),
        origin="user",
    )


def twin_name(name: str) -> str:
    """Return a name with its side exchanged; one without a side is called mirrored."""
    swapped, count = SIDES.subn(lambda found: OTHER_SIDE[found[0]], name)
    return swapped if count else f"{name} mirrored"


def _mirrored(pair: LandmarkPair, place: Place | None, brain: FlatBrain) -> Place | None:
    if place is None or pair.kind in ("left", "right"):
        return place
    if isinstance(place, float):
        return 1.0 - place  # upper, lower and hole run from one side to the other
    coordinates = brain.frame.coordinates(np.array(place))
    coordinates[LEFT_RIGHT] *= -1
    image = brain.frame.points(coordinates)
    x, y, z = find_places(image[np.newaxis], brain.dissection.surface).points[0].tolist()
    return x, y, z
