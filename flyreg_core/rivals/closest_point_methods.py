"""Iterative closest points: to points (rigid, similarity, affine) and to planes (rigid).

All vertices of both brains take part.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from flyreg_core.affine import AffineMap
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.progress import Report
from flyreg_core.rivals.rival import Moved, moved_by

MOST_ROUNDS = 100
"""More than the packages' own 20, with which they stop before they are done."""
CONVERGED_UM = 1e-3
"""A round that moves no vertex farther is the last."""
REACH = 0.2
"""Pairs farther apart than this share of the target's diagonal do not count in point to plane."""
NEIGHBOURS = 20
"""Points whose covariance gives a normal: the package's own number."""


def closest_points_rigid(
    source: SurfaceMesh, target: SurfaceMesh, report: Report, is_scaled: bool = False
) -> Moved:
    """Return the source turned and shifted, and scaled too if so asked, to its closest points.

    References
    ----------
    Besl, McKay, A method for registration of 3-D shapes, IEEE TPAMI 14(2), 1992,
    doi:10.1109/34.121791; as `trimesh.registration.icp` has it.
    """
    from trimesh.registration import icp

    report(0.0, "iterating closest points")
    matrix, _, _ = icp(  # type: ignore[no-untyped-call]
        *(source.vertices, target.vertices),
        max_iterations=MOST_ROUNDS,
        reflection=False,
        scale=is_scaled,
    )
    return moved_by(AffineMap(matrix[:3, :3], matrix[:3, 3]), source)


def closest_points_affine(source: SurfaceMesh, target: SurfaceMesh, report: Report) -> Moved:
    """Return the source under the affine map that least squares of closest points come to."""
    tree = KDTree(target.vertices)
    places = np.column_stack([source.vertices, np.ones(len(source.vertices))])
    moved: Floats = source.vertices
    for done in range(MOST_ROUNDS):
        report(done / MOST_ROUNDS, "iterating closest points")
        nearest = target.vertices[tree.query(moved)[1]]
        rows = np.linalg.lstsq(places, nearest)[0]
        last, moved = moved, np.asarray(places @ rows)
        if np.abs(moved - last).max() < CONVERGED_UM:
            break
    return moved_by(AffineMap(rows[:3].T, rows[3]), source)


def closest_points_to_planes(source: SurfaceMesh, target: SurfaceMesh, report: Report) -> Moved:
    """Return the source turned and shifted to the planes at its closest points.

    References
    ----------
    Chen, Medioni, Object modelling by registration of multiple range images, Image and Vision
    Computing 10(3), 1992, doi:10.1016/0262-8856(92)90066-C; as small_gicp has it: Koide, Journal
    of Open Source Software 9(100), 2024, doi:10.21105/joss.06948.
    """
    import small_gicp

    report(0.0, "iterating closest points to planes")
    clouds = [small_gicp.PointCloud(mesh.vertices) for mesh in (target, source)]
    trees = [small_gicp.KdTree(cloud) for cloud in clouds]
    for cloud, tree in zip(clouds, trees, strict=True):
        small_gicp.estimate_normals_covariances(cloud, tree, num_neighbors=NEIGHBOURS)
    found = small_gicp.align(
        *(*clouds, trees[0]),
        registration_type="PLANE_ICP",
        max_correspondence_distance=REACH * target.diagonal,
        max_iterations=MOST_ROUNDS,
    )
    matrix = found.T_target_source
    return moved_by(AffineMap(matrix[:3, :3], matrix[:3, 3]), source)
