"""Stage 8: how far two surfaces are apart, measured as METRO does."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.progress import Report, within
from flyreg_core.topology import used_vertices

SAMPLES = 100_000
WORKERS, POINTS_PER_REPORT = 2, 20_000
SEED = 20_230_101
"""The samples are the same in every run, so that equal inputs give equal figures."""


@dataclass(frozen=True)
class DistanceSummary:
    """Distances from one surface to another, micrometres."""

    mean_um: float
    rms_um: float
    hausdorff_um: float


@dataclass(frozen=True)
class Distances:
    """Distances both ways, and the bounding-box diagonal of the second surface."""

    diagonal_um: float
    a_to_b: DistanceSummary
    b_to_a: DistanceSummary


def measure_distances(
    a: SurfaceMesh, b: SurfaceMesh, report: Report, samples: int = SAMPLES
) -> Distances:
    """Return the distances between two surfaces, in both directions.

    Mean and RMS are over points drawn evenly by area, one in each of equal shares of it, so the
    error of the mean is below sd / sqrt(samples); the Hausdorff distance is over these points and
    all vertices. Each distance is to the exact closest point.

    References
    ----------
    Cignoni, Rocchini, Scopigno, Metro: measuring error on simplified surfaces, Computer Graphics
    Forum 17(2), 1998, doi:10.1111/1467-8659.00236.
    """
    return Distances(
        b.diagonal,
        _summary(a, b, samples, within(report, 0.0, 0.5)),
        _summary(b, a, samples, within(report, 0.5, 1.0)),
    )


def distances_to_surface(points: Floats, surface: SurfaceMesh, report: Report) -> Floats:
    """Return the (n,) distances of points to the closest points of a surface, micrometres."""
    tree = surface.tree
    parts = np.array_split(points, max(1, -(-len(points) // POINTS_PER_REPORT)))
    answers = []
    pool = ThreadPoolExecutor(WORKERS)  # no search holds the interpreter's lock
    try:
        for done, (squared, _, _) in enumerate(pool.map(tree.nearest, parts)):
            report(done / len(parts), "measuring distances")
            answers.append(np.sqrt(squared))
    finally:
        pool.shutdown(cancel_futures=True)
    return np.concatenate(answers)


def sample_surface(surface: SurfaceMesh, samples: int) -> Floats:
    """Return (samples, 3) points on a surface, one in each of as many equal shares of its area."""
    rng = np.random.default_rng(SEED)
    cumulative = np.cumsum(surface.face_areas)
    position = (np.arange(samples) + rng.uniform(size=samples)) / samples * cumulative[-1]
    face = np.minimum(np.searchsorted(cumulative, position, side="right"), len(cumulative) - 1)
    root, along = np.sqrt(rng.uniform(size=samples)), rng.uniform(size=samples)
    barycentric = np.stack([1 - root, root * (1 - along), root * along], axis=1)
    return np.asarray(np.einsum("ij,ijk->ik", barycentric, surface.vertices[surface.faces[face]]))


def _summary(start: SurfaceMesh, end: SurfaceMesh, samples: int, report: Report) -> DistanceSummary:
    used = start.vertices[used_vertices(start.faces)]
    points = np.concatenate([sample_surface(start, samples), used])
    distance = distances_to_surface(points, end, report)
    return DistanceSummary(
        mean_um=float(distance[:samples].mean()),
        rms_um=float(np.sqrt((distance[:samples] ** 2).mean())),
        hausdorff_um=float(distance.max()),
    )
