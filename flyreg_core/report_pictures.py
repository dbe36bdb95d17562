"""The pictures of a report: both brains, before and after, flat, and coloured by quantities."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np

from flyreg_core.color_maps import SOURCE, TARGET, Colors, colors_of
from flyreg_core.frame import ANTERO_POSTERIOR, DORSO_VENTRAL, LEFT_RIGHT, BrainFrame
from flyreg_core.halves import FlatHalf
from flyreg_core.landmarks import HALVES, HalfName
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.picture import (
    AMBIENT,
    MARGIN,
    SIDES,
    Picture,
    Side,
    View,
    axes_of,
    blended,
    draw_flat,
    see_surface,
    webp_bytes,
)
from flyreg_core.progress import Report, within
from flyreg_core.rectangle import HEIGHT, WIDTH
from flyreg_core.relief import tinted
from flyreg_core.results import Results
from flyreg_core.side_by_side import side_by_side
from flyreg_core.surface_distance import distances_of_vertices

T = TypeVar("T")
R = TypeVar("R")

PIXELS = 420
"""Width of a picture of a brain."""
FLAT_PIXELS = (360, 240)
READABLE = 0.62
"""Brightness of what no light reaches where colours are read off."""
SIDE_CAPTIONS: Mapping[Side, str] = {
    "front": "from the front, dorsal up",
    "back": "from the back, dorsal up",
    "top": "from above, anterior down",
}


@dataclass(frozen=True, eq=False)
class Shot:
    """One picture as a WebP file, and what it shows."""

    caption: str
    webp: bytes
    size: tuple[int, int]


@dataclass(frozen=True)
class Scale:
    """What the colours of a heat map mean: the ends, as paths into the report's facts."""

    quantity: str
    highest: str  # a key of the facts, with dots; the lowest is 0


@dataclass(frozen=True, eq=False)
class Figure:
    """Pictures that belong together."""

    title: str
    text: str
    shots: tuple[Shot, ...]
    scale: Scale | None = None


@dataclass(frozen=True, eq=False)
class _Stage:
    """From where brains that lie in one space are seen: a view and a size for each side."""

    views: Mapping[Side, tuple[View, tuple[int, int]]]

    @classmethod
    def around(cls, points: Floats, frame: BrainFrame) -> _Stage:
        along = frame.coordinates(points)
        low, high = along.min(axis=0), along.max(axis=0)
        middle = frame.points((low + high) / 2)
        scale = MARGIN * float(high[LEFT_RIGHT] - low[LEFT_RIGHT]) / PIXELS
        views = {}
        for side in SIDES:
            up = ANTERO_POSTERIOR if side == "top" else DORSO_VENTRAL
            size = PIXELS, math.ceil(MARGIN * float(high[up] - low[up]) / scale)
            views[side] = View(axes_of(frame, side), middle, scale), size
        return cls(views)


@dataclass(frozen=True, eq=False)
class _Layer:
    """A coloured brain and from where it is seen."""

    stage: _Stage
    surface: SurfaceMesh
    colors: Colors
    ambient: float = AMBIENT


@dataclass(frozen=True)
class _Plan:
    """A figure whose pictures are one layer, or several half transparent over each other."""

    title: str
    text: str
    layers: tuple[str, ...]
    scale: Scale | None = None


BEFORE_FLAT = (
    _Plan("Source", "", ("source",)),
    _Plan("Target", "", ("target",)),
    _Plan(
        "Registered",
        "The source's surface on the target: the source's bumps light, its grooves dark.",
        ("registered",),
    ),
    _Plan(
        "Before",
        "The source, moved by the affine alignment alone, over the target, half transparent.",
        ("aligned", "target"),
    ),
    _Plan(
        "After",
        "The registered source over the target, half transparent.",
        ("registered", "target"),
    ),
)
AFTER_FLAT = (
    _Plan(
        "Distance to the target",
        "Of the registered surface, around each vertex.",
        ("distance",),
        Scale("distance", "distance.source_to_target.p95_um"),
    ),
    _Plan(
        "Displacement",
        "How far the registration took each vertex beyond the affine alignment.",
        ("displacement",),
        Scale("displacement", "displacement_beyond_affine.p95_um"),
    ),
)


def make_figures(
    results: Results, distance_um: float, displacement_um: float, report: Report
) -> tuple[Figure, ...]:
    """Return the pictures of a registration.

    Parameters
    ----------
    distance_um, displacement_um : float
        What the last colours of the two heat maps stand for.
    """
    away = distances_of_vertices(
        results.registration.surface, results.target.surface, within(report, 0.0, 0.2)
    )
    layers = _layers(
        results,
        colors_of(away, 0.0, distance_um),
        colors_of(results.beyond_alignment_um, 0.0, displacement_um),
    )
    pictures = _draw_layers(layers, within(report, 0.2, 0.8))
    plans = [*BEFORE_FLAT, *AFTER_FLAT]
    shots = [
        side_by_side(
            partial(_shot, pictures, plan), SIDES, within(report, 0.8, 0.9), "drawing pictures"
        )
        for plan in plans
    ]
    figures = [
        Figure(plan.title, plan.text, tuple(own), plan.scale)
        for plan, own in zip(plans, shots, strict=True)
    ]
    flat = [_flat_figure(results, half, layers, within(report, 0.9, 1.0)) for half in HALVES]
    return *figures[: len(BEFORE_FLAT)], *flat, *figures[len(BEFORE_FLAT) :]


def _layers(results: Results, distance: Colors, displacement: Colors) -> dict[str, _Layer]:
    source, target = results.source, results.target
    registered = results.registration.surface
    aligned = source.surface.moved(results.alignment.to_target(source.surface.vertices))
    blue, brown = side_by_side(
        lambda brain: tinted(brain[0].relief, brain[1]), ((source, SOURCE), (target, TARGET))
    )
    points = np.concatenate([target.surface.vertices, aligned.vertices])
    stage = _Stage.around(points, target.frame)
    return {
        "source": _Layer(
            _Stage.around(source.surface.vertices, source.frame), source.surface, blue
        ),
        "target": _Layer(stage, target.surface, brown),
        "registered": _Layer(stage, registered, blue),
        "aligned": _Layer(stage, aligned, blue),
        "distance": _Layer(stage, registered, distance, READABLE),
        "displacement": _Layer(stage, registered, displacement, READABLE),
    }


def _draw_layers(
    layers: Mapping[str, _Layer], report: Report
) -> Mapping[tuple[str, Side], Picture]:
    """Return the picture of each layer from each side."""
    on_surface: dict[SurfaceMesh, list[str]] = {}
    for name, layer in layers.items():
        on_surface.setdefault(layer.surface, []).append(name)

    def draw(key: tuple[SurfaceMesh, Side]) -> dict[tuple[str, Side], Picture]:
        surface, side = key
        names = on_surface[surface]
        seen = see_surface(surface, *layers[names[0]].stage.views[side])  # all of them share it
        own = [layers[name] for name in names]
        drawn = [seen.painted(layer.colors, layer.ambient) for layer in own]
        return {(name, side): picture for name, picture in zip(names, drawn, strict=True)}

    keys = [(surface, side) for surface in on_surface for side in SIDES]
    parts = side_by_side(draw, keys, report, "drawing pictures")
    return {key: picture for part in parts for key, picture in part.items()}


def _shot(pictures: Mapping[tuple[str, Side], Picture], plan: _Plan, side: Side) -> Shot:
    own = [pictures[name, side] for name in plan.layers]
    picture = own[0] if len(own) == 1 else blended(own, [1 / len(own)] * len(own))
    return _packed(SIDE_CAPTIONS[side], picture)


def _flat_figure(
    results: Results, half: HalfName, layers: Mapping[str, _Layer], report: Report
) -> Figure:
    """Return the pictures of one half laid flat."""
    own, other = results.source.halves[half], results.target.halves[half]
    warped = results.registration.halves[half].plane
    blue, brown = layers["source"].colors[own.vertex_of], layers["target"].colors[other.vertex_of]

    def shot(layer: tuple[str, Floats, FlatHalf, Colors]) -> Shot:
        name, plane, flat, colors = layer
        extent = WIDTH, HEIGHT
        return _packed(name, draw_flat(plane, flat.faces, colors, extent, FLAT_PIXELS))

    drawn = (
        ("source", own.plane, own, blue),
        ("source after the spline", warped, own, blue),
        ("target", other.plane, other, brown),
    )
    seen = "front" if half == "anterior" else "back"
    text = f"The rectangle with the oesophagus in its middle, seen from the {seen}."
    shots = side_by_side(shot, drawn, report, "drawing pictures")
    return Figure(f"{half.capitalize()} half, flat", text, tuple(shots))


def _packed(caption: str, picture: Picture) -> Shot:
    return Shot(caption, webp_bytes(picture), (picture.shape[1], picture.shape[0]))
