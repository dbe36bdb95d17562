"""All rivals by name, in the order in which a comparison shows them."""

from __future__ import annotations

from functools import partial

from flyreg_core.rivals.bending_mesh import ROUNDS, bend_mesh
from flyreg_core.rivals.closest_point_methods import (
    closest_points_affine,
    closest_points_rigid,
    closest_points_to_planes,
)
from flyreg_core.rivals.coherent_point_drift import (
    DENSE_POINTS,
    LOW_RANK_POINTS,
    RANK,
    drift_affine,
    drift_freely,
    drift_rigid,
)
from flyreg_core.rivals.normal_distributions import fit_distributions
from flyreg_core.rivals.rival import Rival
from flyreg_core.rivals.unmoved import leave

RIVALS = (
    Rival("none", "As the files lie", "nothing is moved", leave, is_aligned=False),
    Rival(
        "alignment",
        "Affine alignment",
        "the affine alignment of flyreg, where all rivals start",
        leave,
    ),
    Rival("icp-rigid", "ICP, rigid", "iterative closest points, rigid", closest_points_rigid),
    Rival(
        "icp-similarity",
        "ICP, rigid and scaled",
        "iterative closest points, rigid and scaled",
        partial(closest_points_rigid, is_scaled=True),
    ),
    Rival("icp-affine", "ICP, affine", "iterative closest points, affine", closest_points_affine),
    Rival(
        "icp-plane",
        "ICP to planes, rigid",
        "iterative closest points to planes, rigid",
        closest_points_to_planes,
        package="small_gicp",
    ),
    Rival("ndt", "NDT, rigid", "normal distributions transform, rigid", fit_distributions),
    Rival(
        "cpd-rigid",
        "CPD, rigid and scaled",
        f"coherent point drift, rigid and scaled, {DENSE_POINTS} points of each",
        drift_rigid,
        package="rustcpd",
    ),
    Rival(
        "cpd-affine",
        "CPD, affine",
        f"coherent point drift, affine, {DENSE_POINTS} points of each",
        drift_affine,
        package="rustcpd",
    ),
    Rival(
        "cpd-nonrigid",
        "CPD, non-rigid",
        f"coherent point drift, non-rigid, {DENSE_POINTS} points of each",
        drift_freely,
        package="rustcpd",
    ),
    Rival(
        "cpd-low-rank",
        "CPD, non-rigid, low rank",
        f"coherent point drift, non-rigid, rank {RANK}, {LOW_RANK_POINTS} points of each",
        partial(drift_freely, count=LOW_RANK_POINTS, rank=RANK),
        package="rustcpd",
    ),
    Rival(
        "nricp",
        "Non-rigid ICP",
        "optimal step non-rigid ICP after affine ICP, from stiff to soft, source reduced to "
        + " and then ".join(f"{each.vertices} vertices" for each in ROUNDS),
        bend_mesh,
        package="rtree",
    ),
)

RIVAL_OF = {rival.name: rival for rival in RIVALS}
