"""Coherent point drift: rigid, affine, and non-rigid with all of its kernel or a part of it.

The settings are those of the authors' own program: normalized to unit scale, 0.1 of the points
taken for outliers, beta 2, lambda 3, at most 150 rounds, done when the variance changes by 1e-5.

References
----------
Myronenko, Song, Point set registration: coherent point drift, IEEE TPAMI 32(12), 2010,
doi:10.1109/TPAMI.2010.46; as rustcpd has it.
"""

from __future__ import annotations

from typing import Any

from flyreg_core.affine import AffineMap
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.progress import Report, ignore, in_chunks
from flyreg_core.rivals.rival import Moved, moved_by
from flyreg_core.surface_distance import sample_surface

DENSE_POINTS = 2000
"""Points of each brain, spread evenly over its surface, where time grows with their cube."""
LOW_RANK_POINTS, RANK = 5000, 300
POINTS_AT_ONCE = 5000
"""As many are carried at once: each takes as many kernel values as there are points of the source."""
BETA, LAMBDA = 2.0, 3.0
SETTINGS: dict[str, Any] = {
    "normalize": True,
    "outlier_weight": 0.1,
    "max_iterations": 150,
    "tolerance": 1e-5,
}


def drift_rigid(source: SurfaceMesh, target: SurfaceMesh, report: Report) -> Moved:
    """Return the source turned, shifted and scaled (Fig. 2 of the paper)."""
    import rustcpd

    found = rustcpd.register_rigid(*_points(source, target, DENSE_POINTS, report), **SETTINGS)
    return moved_by(AffineMap(found.scale * found.rotation.T, found.translation), source)


def drift_affine(source: SurfaceMesh, target: SurfaceMesh, report: Report) -> Moved:
    """Return the source under an affine map (Fig. 3 of the paper)."""
    import rustcpd

    found = rustcpd.register_affine(*_points(source, target, DENSE_POINTS, report), **SETTINGS)
    return moved_by(AffineMap(found.transform.T, found.translation), source)


def drift_freely(
    source: SurfaceMesh,
    target: SurfaceMesh,
    report: Report,
    count: int = DENSE_POINTS,
    rank: int | None = None,
) -> Moved:
    """Return the source bent coherently (Fig. 4 of the paper).

    Parameters
    ----------
    rank : int, optional
        Of the part of the kernel that is used, found by pivoted Cholesky; None takes all of it.
    """
    import rustcpd

    found = rustcpd.register_deformable(
        *_points(source, target, count, report),
        alpha=LAMBDA,
        beta=BETA,
        low_rank=rank,
        low_rank_method="pivoted_cholesky",
        **SETTINGS,
    )

    def carry(points: Floats) -> Floats:
        return in_chunks(found.transform, points, ignore, "", POINTS_AT_ONCE)

    return moved_by(carry, source)


def _points(
    source: SurfaceMesh, target: SurfaceMesh, count: int, report: Report
) -> tuple[Floats, Floats]:
    """Return points of the target and of the source, in the order that the package takes them."""
    report(0.0, "letting points drift")
    return sample_surface(target, count), sample_surface(source, count)
