"""What simplifying and smoothing cost a brain's shape, for how much of each (Figures 7 and 8)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from flyreg_core.chart import Axis, Band, Line, Panel, draw_panels
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.progress import Report, within
from flyreg_core.simplify import FEWEST_VERTICES, SMALLEST_SHARE, coarser
from flyreg_core.smooth import averaged, averaging_matrix
from flyreg_core.surface_distance import distances_to_surface, sample_surface

TOLERANCES = np.geomspace(1e-5, 5e-3, 12)
"""By how much vertices may move for simplification, in diagonals of the brain."""
PASSES = (0, 25, 50, 100, 150, 200, 300, 400, 500, 600, 800, 1000)
SAMPLES = 10_000
MOST_AREA_LOST = 0.01
VOXELS_ACROSS_DIAGONAL = 1100
"""Of the paper's brains: where no voxel is known, one counts as this part of the diagonal."""
FIRST_PASSES = 100
SETTLED = 0.15
"""Smoothing goes slowly once so many more passes cost this share of the area that the first ones cost:
from pass 341 on for FCWB; the paper calls its curve flat, by eye, from about 400 on."""


@dataclass(frozen=True)
class Distortion:
    """What one amount of simplifying or smoothing costs."""

    amount: float  # share of the vertices kept, or passes
    vertices: int
    area_share: float  # area over that of the surface as it was
    mean_distance_um: float  # from the surface as it was and back, the larger of both


@dataclass(frozen=True)
class DistortionCurve:
    """The cost of several amounts, and which of them are recommended."""

    points: tuple[Distortion, ...]  # by growing amount
    least: float | None  # recommended from here on; None: no amount that was tried
    reason: str  # a sentence that says by what principle


@dataclass(frozen=True)
class DistortionCurves:
    """Both curves of one brain."""

    simplification: DistortionCurve
    smoothing: DistortionCurve
    voxel_um: float  # what the distances were compared with


def find_curves(
    surface: SurfaceMesh, voxel_edge_um: float | None, report: Report
) -> DistortionCurves:
    """Return both curves of a prepared main brain.

    Parameters
    ----------
    surface : SurfaceMesh
        Closed.
    voxel_edge_um : float, optional
        Edge of a voxel of the image; None takes a part of the diagonal.

    References
    ----------
    Figures 7 and 8 of the paper, and section 4.2.
    """
    voxel = voxel_edge_um or surface.diagonal / VOXELS_ACROSS_DIAGONAL
    return DistortionCurves(
        simplification_curve(surface, voxel, within(report, 0.0, 0.5)),
        smoothing_curve(surface, within(report, 0.5, 1.0)),
        voxel,
    )


def simplification_curve(surface: SurfaceMesh, voxel_um: float, report: Report) -> DistortionCurve:
    """Return what keeping a share of the vertices costs.

    Recommended are shares from which on the area stays within 1 % and the mean distance within a
    voxel, but no fewer vertices than the paper advises.
    """
    before = len(surface.vertices)
    points = [Distortion(1.0, before, 1.0, 0.0)]
    for done, tolerance in enumerate(TOLERANCES):
        report(done / len(TOLERANCES), "simplifying the surface")
        changed = coarser(surface, float(tolerance) * surface.diagonal)
        if 0 < len(changed.vertices) < points[0].vertices:
            share = len(changed.vertices) / before
            points.insert(0, _distortion(share, changed, surface, report, done / len(TOLERANCES)))
    floor = min(max(SMALLEST_SHARE, FEWEST_VERTICES / before), 1.0)
    kept = [
        point
        for point in points
        if point.amount >= floor
        and abs(1 - point.area_share) <= MOST_AREA_LOST
        and point.mean_distance_um <= voxel_um
    ]
    least = max(min((point.amount for point in kept), default=1.0), floor)
    return DistortionCurve(
        tuple(points),
        least,
        f"area within {MOST_AREA_LOST:.0%} and mean distance within {voxel_um:.3g} µm (a voxel), "
        f"with at least {FEWEST_VERTICES} vertices and {SMALLEST_SHARE:.0%} of them kept",
    )


def smoothing_curve(surface: SurfaceMesh, report: Report) -> DistortionCurve:
    """Return what averaging passes cost.

    Recommended are passes from which on it goes slowly, see `settled_from`. There is no most: only
    the cut between the halves is made on the smoothed surface, so that what it loses is not lost.
    """
    matrix = averaging_matrix(surface.faces, len(surface.vertices))
    points = [Distortion(0, len(surface.vertices), 1.0, 0.0)]
    vertices = np.array(surface.vertices)
    for number in range(1, len(PASSES)):
        share = (number - 1) / (len(PASSES) - 1)
        silent = within(report, share, share)
        vertices = averaged(matrix, vertices, PASSES[number] - PASSES[number - 1], silent)
        changed = surface.moved(vertices.copy())
        points.append(_distortion(PASSES[number], changed, surface, report, share))
    return DistortionCurve(
        tuple(points),
        settled_from(points),
        f"{FIRST_PASSES} more passes cost less than {SETTLED:.0%} of the area that the first "
        f"{FIRST_PASSES} cost; only the cut between the halves is made on the smoothed surface",
    )


def settled_from(points: Sequence[Distortion]) -> int | None:
    """Return from which pass on 100 more cost less than 15 % of the area that the first 100 cost.

    None if that is beyond what was tried, or smoothing cost no area.

    Notes
    -----
    There is no knee to find: on brains area is lost about as a power of the passes, of 0.3 to 0.4. So
    the loss L is fitted as ln L = a + b ln p + c (ln p)^2 to all passes p that were tried, and
    L(p + 100) - L(p) of the fit is compared with L(100). A change of the curve by 1 % moves the
    answer by some per cent then; what neighbours among those tried cost would move it from one to the
    next.
    """
    tried = [point for point in points if point.amount > 0]
    lost = np.array([1 - point.area_share for point in tried])
    if len(tried) < 3 or (lost <= 0).any():
        return None
    passes = np.array([point.amount for point in tried])
    logarithm = np.polynomial.Polynomial.fit(np.log(passes), np.log(lost), 2)
    each = np.arange(int(passes.max()) + FIRST_PASSES + 1)
    fitted = np.concatenate([[0.0], np.exp(logarithm(np.log(each[1:])))])
    more = fitted[FIRST_PASSES:] - fitted[:-FIRST_PASSES]
    fast = np.flatnonzero(more >= SETTLED * fitted[FIRST_PASSES])
    start = int(fast[-1]) + 1 if len(fast) else 0
    return start if start < passes.max() else None


def _distortion(
    amount: float, changed: SurfaceMesh, surface: SurfaceMesh, report: Report, share: float
) -> Distortion:
    silent = within(report, share, share)
    means = [
        float(distances_to_surface(sample_surface(start, SAMPLES), end, silent).mean())
        for start, end in ((changed, surface), (surface, changed))
    ]
    area_share = float(changed.face_areas.sum() / surface.face_areas.sum())
    return Distortion(amount, len(changed.vertices), area_share, max(means))


def curves_report(curves: DistortionCurves) -> Mapping[str, object]:
    """Return both curves as facts for JSON."""
    return asdict(curves)


def draw_curves(curves: DistortionCurves, ink: str = "#222222", paper: str | None = None) -> str:
    """Return both curves as an SVG document of four panels: area above, distance below."""
    columns = (
        ("Simplification", "share of the vertices kept", curves.simplification),
        ("Smoothing", "passes", curves.smoothing),
    )
    return draw_panels(
        [
            _panel(title, label, curve, name, value)
            for name, value in (
                ("area, share of that before", lambda point: point.area_share),
                ("mean distance, µm", lambda point: point.mean_distance_um),
            )
            for title, label, curve in columns
        ],
        2,
        ink,
        paper,
    )


def _panel(
    title: str, label: str, curve: DistortionCurve, name: str, value: Callable[[Distortion], float]
) -> Panel:
    amounts = tuple(point.amount for point in curve.points)
    line = Line(name, amounts, tuple(value(point) for point in curve.points))
    band = None if curve.least is None else Band(curve.least, max(amounts), "recommended")
    return Panel(title, (line,), Axis(label, includes=(0.0,)), Axis(name), band=band)
