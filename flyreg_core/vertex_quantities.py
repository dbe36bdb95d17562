"""Quantities by which a registration is judged, at each vertex: where it is off, and at which stage."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from flyreg_core.affine import best_affine
from flyreg_core.correspondence import FlatBrain
from flyreg_core.distortion import log_area_ratios, log_dilatations, to_vertices
from flyreg_core.landmarks import HALVES
from flyreg_core.mesh import Floats, Integers, SurfaceMesh
from flyreg_core.progress import Report, within
from flyreg_core.results import Results
from flyreg_core.seam import (
    angles_across_seam,
    distances_to_chain,
    hole_chain,
    seam_vertices,
)
from flyreg_core.surface_distance import distances_of_vertices
from flyreg_core.vertex_properties import STATUS, vertex_status, weight_influence

ROBUST = 98.0
"""Colours span this many per cent of the values; those beyond have the colours of the ends."""
LEAST_FACTOR = float(np.log2(1.1))
"""Colours of factors span at least this, so that what changes nothing looks like nothing."""
TINIEST = 1e-9
BINS = 60
SEAM_STRIP = 0.008
"""Half the width of the strip along curves that shows their values, in diagonals."""


@dataclass(frozen=True, eq=False)
class VertexValues:
    """Values at the vertices of the source, which the registered surface shares, and of the target."""

    source: Floats | None  # (n,), NaN where there is none; None: not of this brain
    target: Floats | None = None


Compute = Callable[[Results, Report], VertexValues]


@dataclass(frozen=True)
class Quantity:
    """What can be judged."""

    name: str
    title: str
    unit: str  # "µm", "°", "×" for logarithms to base 2 of a factor, "" for plain numbers
    meaning: str
    compute: Compute
    is_signed: bool = False


@dataclass(frozen=True, eq=False)
class Summary:
    """Values over a surface, each vertex counting as much as the area around it."""

    mean: float
    rms: float
    p95: float  # of the sizes, if the quantity is signed
    largest: float  # likewise
    low: float  # of the range that colours span
    high: float
    edges: Floats  # (b + 1,), of the bins over that range
    shares: Floats  # (b,) of the area in each


def summarize(values: Floats, areas: Floats, quantity: Quantity, within: float = 0.0) -> Summary:
    """Return the summary of (n,) values, some perhaps NaN, with the areas around their vertices.

    The colours' range is 0 to the 98th percentile, or as far to both sides of 0 if signed; and not
    less than to `within`, or to a tenth if the values tell a factor.
    """
    known = np.isfinite(values)
    values, weights = values[known], areas[known]
    if not len(values) or weights.sum() <= 0:
        return Summary(0.0, 0.0, 0.0, 0.0, 0.0, 1.0, np.linspace(0, 1, BINS + 1), np.zeros(BINS))
    weights = weights / weights.sum()
    sizes = np.abs(values)
    order = np.argsort(sizes)
    reached = np.cumsum(weights[order])
    p95, robust = (
        float(sizes[order[min(int(np.searchsorted(reached, share)), len(order) - 1)]])
        for share in (0.95, ROBUST / 100)
    )
    least = LEAST_FACTOR if quantity.unit == "×" else TINIEST
    high = max(robust, within, least)
    low = -high if quantity.is_signed else 0.0
    shares, edges = np.histogram(np.clip(values, low, high), BINS, (low, high), weights=weights)
    rms = float(np.sqrt(weights @ values**2))
    return Summary(float(weights @ values), rms, p95, float(sizes.max()), low, high, edges, shares)


def _distance(results: Results, report: Report) -> VertexValues:
    """Vertices lie on the target by construction: the faces around them tell how far it is between."""
    moved, target = results.registration.surface, results.target.surface
    here = distances_of_vertices(moved, target, within(report, 0.0, 0.5))
    return VertexValues(here, distances_of_vertices(target, moved, within(report, 0.5, 1.0)))


def _displacement(results: Results, report: Report) -> VertexValues:
    return VertexValues(results.beyond_alignment_um)


def _beyond_affine(results: Results, report: Report) -> VertexValues:
    surface, moved = results.source.surface, results.registration.surface.vertices
    fitted = best_affine(surface, moved)(surface.vertices)
    return VertexValues(np.asarray(np.linalg.norm(moved - fitted, axis=1)))


def _stage(before: str, after: str, measure: Callable[[Floats, Floats], Floats]) -> Compute:
    """Return what measures triangles from one shape of the source to another."""

    def compute(results: Results, report: Report) -> VertexValues:
        surface = results.source.surface
        result = np.full(len(surface.vertices), np.nan)
        for half in HALVES:
            flat, warped = results.source.halves[half], results.registration.halves[half]
            shapes: Mapping[str, Floats] = {
                "source": surface.vertices[flat.vertex_of],
                "flat": flat.plane,
                "bent": warped.plane,
                "registered": results.registration.surface.vertices[flat.vertex_of],
            }
            corners = [shapes[name][flat.faces] for name in (before, after)]
            areas = SurfaceMesh(shapes["source"], flat.faces).face_areas
            values = measure(*corners)
            if "flat" in (before, after) and "source" in (before, after):
                values = _relative(values, areas, measure)
            result[flat.vertex_of] = to_vertices(values, flat.faces, areas, len(flat.vertex_of))
        return VertexValues(result)

    return compute


def _relative(values: Floats, areas: Floats, measure: Callable[[Floats, Floats], Floats]) -> Floats:
    """Return log areas against the whole half's; a rectangle has no micrometres."""
    if measure is not log_area_ratios:
        return values
    return np.asarray(values - np.log2(areas @ np.exp2(values) / areas.sum()))


def _seam(results: Results, report: Report) -> VertexValues:
    surface, curves = results.source.surface, results.source.flat.curves
    gaps = np.zeros(len(surface.vertices))
    for half in HALVES:
        for key, own in results.registration.halves[half].gaps_um.items():
            np.maximum.at(gaps, curves[key].vertices, own)
    along = np.unique(np.concatenate([curve.vertices for curve in curves.values()]))
    return VertexValues(_beside(surface, along, gaps[along]))


def _seam_angle(results: Results, report: Report) -> VertexValues:
    source, target = results.source, results.target
    moved = results.registration.surface
    return VertexValues(
        _beside(moved, seam_vertices(source.flat), angles_across_seam(moved.vertices, source.flat)),
        _beside(
            target.surface,
            seam_vertices(target.flat),
            angles_across_seam(target.surface.vertices, target.flat),
        ),
    )


def _hole(results: Results, report: Report) -> VertexValues:
    source, target = results.source.flat, results.target.flat
    moved, fixed = results.registration.surface, results.target.surface
    own, other = hole_chain(moved.vertices, source), hole_chain(fixed.vertices, target)
    return VertexValues(
        _beside_hole(moved, source, distances_to_chain(own, other)),
        _beside_hole(fixed, target, distances_to_chain(other, own)),
    )


def _beside_hole(surface: SurfaceMesh, brain: FlatBrain, away: Floats) -> Floats:
    """Return the distances of the hole's (c - 1,) edges, at each vertex the larger of its two."""
    return _beside(
        surface, brain.curves["hole", None].vertices[:-1], np.maximum(away, np.roll(away, 1))
    )


def _beside(surface: SurfaceMesh, along: Integers, values: Floats) -> Floats:
    """Return (k,) values of vertices in a strip beside them wide enough to be seen, else NaN."""
    away, nearest = KDTree(surface.vertices[along]).query(surface.vertices)
    return np.where(away <= SEAM_STRIP * surface.diagonal, values[nearest], np.nan)


def _influence(results: Results, report: Report) -> VertexValues:
    return VertexValues(weight_influence(results))


def _status(results: Results, report: Report) -> VertexValues:
    return VertexValues(vertex_status(results).astype(float))


QUANTITIES = (
    Quantity(
        "distance",
        "Distance to the other surface",
        "µm",
        "How far the registered surface is from the target, and the target from it",
        _distance,
    ),
    Quantity(
        "displacement",
        "Displacement",
        "µm",
        "How far each place moves from where the affine alignment of the outsides puts it",
        _displacement,
    ),
    Quantity(
        "beyond_affine",
        "Displacement beyond affine",
        "µm",
        "How far each place moves from where the best affine map of the whole source puts it",
        _beyond_affine,
    ),
    Quantity(
        "flattening_area",
        "Area: flattening",
        "×",
        "How much larger a place becomes when the source is laid flat, against its whole half",
        _stage("source", "flat", log_area_ratios),
        is_signed=True,
    ),
    Quantity(
        "flattening_angle",
        "Angles: flattening",
        "×",
        "How much more a place is stretched one way than the other when the source is laid flat",
        _stage("source", "flat", log_dilatations),
    ),
    Quantity(
        "spline_area",
        "Area: spline",
        "×",
        "How much larger the spline makes a place of the rectangle",
        _stage("flat", "bent", log_area_ratios),
        is_signed=True,
    ),
    Quantity(
        "spline_angle",
        "Angles: spline",
        "×",
        "How much more the spline stretches a place of the rectangle one way than the other",
        _stage("flat", "bent", log_dilatations),
    ),
    Quantity(
        "seam",
        "Seam gap",
        "µm",
        "How far sewing the halves moved their curves along the target, from where each alone would go",
        _seam,
    ),
    Quantity(
        "seam_angle",
        "Seam angle",
        "°",
        "By how much each surface turns where the two halves meet, within 5 µm to both sides: where "
        "the registered one turns more than the target, the seam is a kink",
        _seam_angle,
    ),
    Quantity(
        "hole",
        "Oesophagus curve",
        "µm",
        "How far the registered curve around the oesophagus is from the target's, and the target's "
        "from it, deep in the brain: cut through it left-right (K) to see the colours",
        _hole,
    ),
    Quantity(
        "whole_area",
        "Area: source to registered",
        "×",
        "How much larger a place is on the target than on the source, all stages together",
        _stage("source", "registered", log_area_ratios),
        is_signed=True,
    ),
    Quantity(
        "whole_angle",
        "Angles: source to registered",
        "×",
        "How much more a place is stretched one way than the other, all stages together",
        _stage("source", "registered", log_dilatations),
    ),
    Quantity(
        "influence",
        "Influence of weights",
        "",
        "The landmarks' weights, fading with the distance in the rectangle",
        _influence,
    ),
    Quantity(
        "status",
        "How vertices got their place",
        "",
        "By the spline, on a curve, moved to mend a fold, or on a trim cap",
        _status,
    ),
)
STATUS_NAMES = tuple(STATUS)


def quantity_named(name: str) -> Quantity:
    """Return a quantity by its name."""
    return next(quantity for quantity in QUANTITIES if quantity.name == name)
