"""Stage 8: how far two surfaces are apart, measured as METRO does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flyreg_core.mesh import Floats, Integers, SurfaceMesh
from flyreg_core.progress import Report, within
from flyreg_core.side_by_side import both, side_by_side
from flyreg_core.topology import used_vertices

SAMPLES = 100_000
POINTS_PER_REPORT = 20_000
SEED = 20_230_101
"""The samples are the same in every run, so that equal inputs give equal figures."""


PERCENTILES = (50, 95, 99)


@dataclass(frozen=True)
class DistanceSummary:
    """Distances from one surface to another, micrometres."""

    mean_um: float
    rms_um: float
    hausdorff_um: float
    percentiles_um: tuple[float, ...]  # as `PERCENTILES` names them, by area
    standard_error_um: float  # of the mean


@dataclass(frozen=True)
class Distances:
    """Distances both ways, and the bounding-box diagonal of the second surface."""

    diagonal_um: float
    a_to_b: DistanceSummary
    b_to_a: DistanceSummary
    samples: int  # points on each surface


def measure_distances(
    a: SurfaceMesh, b: SurfaceMesh, report: Report, samples: int = SAMPLES
) -> Distances:
    """Return the distances between two surfaces, in both directions.

    Mean, RMS and percentiles are over points drawn evenly by area, one in each of equal shares of
    it. The standard error of the mean is sd / sqrt(samples), which independent points would have;
    these have less. The Hausdorff distance is over these points and all vertices, so that what it
    misses is less than how far a point of a face can lie from all of them. Each distance is to the
    exact closest point.

    References
    ----------
    Cignoni, Rocchini, Scopigno, Metro: measuring error on simplified surfaces, Computer Graphics
    Forum 17(2), 1998, doi:10.1111/1467-8659.00236.
    """
    of_a, of_b = both(lambda: _points_of(a, samples), lambda: _points_of(b, samples))
    from_a = distances_to_surface(of_a, b, within(report, 0.0, 0.5))
    from_b = distances_to_surface(of_b, a, within(report, 0.5, 1.0))
    summaries = both(lambda: _summary(from_a, samples), lambda: _summary(from_b, samples))
    return Distances(b.diagonal, *summaries, samples)


def distances_of_vertices(a: SurfaceMesh, b: SurfaceMesh, report: Report) -> Floats:
    """Return for each vertex of a surface how far the faces around it are from another, micrometres.

    The (n,) mean over those faces by area, 0 where there is none: made for colouring, where the
    distances of the vertices alone would tell nothing, as registration puts all of them on the
    target.

    Notes
    -----
    A face counts with the mean of the distances at the middles of its sides, which is exact where
    the distance is a polynomial of degree 2.
    """
    n, corners = len(a.vertices), a.faces.reshape(-1)
    sides = np.sort(a.faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    keys, edge_of_side = np.unique(sides[..., 0] * n + sides[..., 1], return_inverse=True)
    edges = np.stack(np.divmod(keys, n), axis=1)
    away = distances_to_surface(a.vertices[edges].mean(axis=1), b, report)
    of_face = away[edge_of_side].reshape(a.faces.shape).mean(axis=1)
    area = np.bincount(corners, np.repeat(a.face_areas, 3), n)
    total = np.bincount(corners, np.repeat(a.face_areas * of_face, 3), n)
    return np.asarray(np.divide(total, area, out=np.zeros(n), where=area > 0))


def distances_to_surface(points: Floats, surface: SurfaceMesh, report: Report) -> Floats:
    """Return the (n,) distances of points to the closest points of a surface, micrometres."""
    tree = surface.tree
    parts = np.array_split(points, max(1, -(-len(points) // POINTS_PER_REPORT)))
    squared = side_by_side(lambda part: tree.nearest(part)[0], parts, report, "measuring distances")
    return np.sqrt(np.concatenate(squared))


def sample_surface(surface: SurfaceMesh, samples: int, order: Integers | None = None) -> Floats:
    """Return (samples, 3) points on a surface, one in each of as many equal shares of its area.

    The shares run through the faces as they are numbered, or in another order.
    """
    rng = np.random.default_rng(SEED)
    order = np.arange(len(surface.faces)) if order is None else order
    cumulative = np.cumsum(surface.face_areas[order])
    position = (np.arange(samples) + rng.uniform(size=samples)) / samples * cumulative[-1]
    place = np.minimum(np.searchsorted(cumulative, position, side="right"), len(order) - 1)
    face = order[place]
    root, along = np.sqrt(rng.uniform(size=samples)), rng.uniform(size=samples)
    barycentric = np.stack([1 - root, root * (1 - along), root * along], axis=1)
    return np.asarray(np.einsum("ij,ijk->ik", barycentric, surface.vertices[surface.faces[face]]))


def _points_of(surface: SurfaceMesh, samples: int) -> Floats:
    """Return (samples + n, 3) samples of a surface and after them its n used vertices.

    The samples run as faces lie in the boxes of its tree: those that follow one another lie next to
    one another, so that what is nearest to them is mostly in fast memory already.
    """
    used = surface.vertices[used_vertices(surface.faces)]
    return np.concatenate([sample_surface(surface, samples, surface.tree.face), used])


def _summary(everywhere: Floats, samples: int) -> DistanceSummary:
    """Return the summary of the distances of so many samples and, after them, of vertices."""
    distance = everywhere[:samples]
    return DistanceSummary(
        mean_um=float(distance.mean()),
        rms_um=float(np.sqrt((distance**2).mean())),
        hausdorff_um=float(everywhere.max()),
        percentiles_um=tuple(map(float, np.percentile(distance, PERCENTILES))),
        standard_error_um=float(distance.std(ddof=1) / np.sqrt(samples)),
    )
