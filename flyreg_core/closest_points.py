"""Affine maps between the outsides of two brains, from closest points both ways."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.spatial import KDTree

from flyreg_core.affine import AffineMap, fit_affine, fit_similarity
from flyreg_core.mesh import Floats, Integers
from flyreg_core.progress import Report
from flyreg_core.skin import Skin

Freedom = Literal["rigid", "similarity", "affine"]

ALONG = 0.05
"""Weight of what is off along the surface, against 1 across it, once the map is affine."""
TOLERANCE = 1.5
"""Pairs this many medians apart count a quarter."""
CONVERGED_UM = 1e-3
"""A round that moves no corner of the brain farther is the last."""
FARTHEST_UM = 60.0
"""Differences beyond this count no more when poses are compared."""


def fit_skins(
    source: Skin,
    target: Skin,
    start: AffineMap,
    freedom: Freedom,
    rounds: int,
    queries: int,
    report: Report,
) -> AffineMap:
    """Return the map near `start` that lays one skin on the other.

    Each round pairs points of both skins with the most similar point of the other one, in position
    and normal together, and fits the map to all pairs, far ones counting little. Pairs both ways
    keep the map from shrinking the source into the target.

    Parameters
    ----------
    queries : int
        About how many points of each skin look for a partner among all of the other.

    References
    ----------
    Besl, McKay, A method for registration of 3-D shapes, IEEE TPAMI 14(2), 1992,
    doi:10.1109/34.121791; point-to-plane: Chen, Medioni, Image and Vision Computing 10(3), 1992,
    doi:10.1016/0262-8856(92)90066-C; weights: Geman, McClure 1987.
    """
    tree = KDTree(target.features)
    some, others = (
        np.arange(0, len(skin.points), max(1, len(skin.points) // queries))
        for skin in (source, target)
    )
    found = start
    for done in range(rounds):
        report(done / rounds, "aligning the brains")
        place, partner, weights = find_pairs(
            source.moved(found).features, target.features, tree, some, others
        )
        first, last = source.points[place], target.points[partner]
        if freedom == "affine":
            better = fit_affine(first, last, target.normals[partner], weights, ALONG)
        else:
            is_scaled = freedom == "similarity"
            better = fit_similarity(first, last, weights, is_scaled, start.is_mirroring)
        step = float(np.abs(better(source.points[some]) - found(source.points[some])).max())
        found = better
        if step < CONVERGED_UM:
            break
    return found


def find_pairs(
    moved: Floats, goal: Floats, tree: KDTree, some: Integers, others: Integers
) -> tuple[Integers, Integers, Floats]:
    """Return pairs of places of two skins that are most like each other, from both sides.

    Parameters
    ----------
    moved, goal : (n, 6) and (m, 6) float
        Features of the source's skin where it lies now, and of the target's, which the tree holds.
    some, others : (k,) and (l,) int
        The places of source and target that look for a partner.

    Returns
    -------
    (k + l,) int, (k + l,) int, (k + l,) float
        Places of source and target, and weights, small for pairs far apart.
    """
    apart, there = tree.query(moved[some])
    apart_back, back = KDTree(moved, balanced_tree=False).query(goal[others])
    away = np.concatenate([apart, apart_back])
    weights = (1 + (away / (TOLERANCE * np.median(away) + 1e-9)) ** 2) ** -2
    return np.concatenate([some, back]), np.concatenate([there, others]), weights


def misfit(source: Skin, target: Skin, by: AffineMap, queries: int) -> float:
    """Return how unlike two skins are once one is moved, micrometres, normals included.

    The mean over points of both of the difference to the most similar point of the other.
    """
    moved = source.moved(by)
    there = KDTree(target.features).query(_thinned(moved, queries).features)[0]
    back = KDTree(moved.features, balanced_tree=False).query(_thinned(target, queries).features)[0]
    return float(sum(np.minimum(away, FARTHEST_UM).mean() for away in (there, back)) / 2)


def _thinned(skin: Skin, count: int) -> Skin:
    step = max(1, len(skin.points) // count)
    return Skin(skin.points[::step], skin.normals[::step])
