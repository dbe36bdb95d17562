"""How one brain has to be bent to lie on another: a smooth map of space, from their outsides alone.

An affine map leaves the antennal lobes of one brain beside those of another. Here closest points
of the two skins, positions and normals together, bend space from stiff to soft, as far as the skins
ask for it and no further. Which places correspond along the surface, where a smooth brain shows
little, is decided by what a bend costs: both strain and bending have their price, so that nothing
is sheared that need not be.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve, polar
from scipy.spatial import KDTree

from flyreg_core.affine import AffineMap
from flyreg_core.bending_basis import N_AFFINE, BendingBasis, make_basis
from flyreg_core.closest_points import find_pairs, fit_skins
from flyreg_core.mesh import Floats, Integers, SurfaceMesh
from flyreg_core.progress import Report, ignore, within
from flyreg_core.skin import NORMAL_UM, Skin, find_skin

SAMPLES = 16_000
"""Points drawn on each surface."""
QUERIES = 2500
"""About how many points of each skin look for a partner in each round."""
SIMILARITY_ROUNDS = 40
LEAST_ROUNDS, MOST_ROUNDS = 20, 39
STIFFNESS = 0.73 ** np.arange(MOST_ROUNDS)
"""Price of bending in each round: at first only the whole brain bends, at last single lobes."""
DETAIL = np.minimum(0.1 * 1.083 ** np.arange(MOST_ROUNDS), 1.0)
"""Share of the bumps and of the queries that each round uses: stiff ones need no detail."""
PAID_UM2 = 2.0
"""No round follows one in which all bending costs no more than this: what softer ones would gain
lies within the 1.4 micrometres to which the outline of a brain is known."""
PAST_HEIGHT = 0.5
"""The cost of bending rises first: it counts when it has fallen to this share of its height."""
LEAST_VOLUME = 0.1
"""No place of a skin may shrink to less of its volume: bent softer, space would fold there."""
STRAIN = 1.0
"""Price of strain of the whole brain, against 1 of bending."""
ALONG = 0.1
"""Weight of what is off along the surface, against 1 across it."""
TANGENT_UM = 1.0
"""How far apart places are by whose motion it is told how a map turns and stretches."""
INVERSE_ROUNDS, INVERSE_UM = 20, 1e-6


@dataclass(frozen=True, eq=False)
class ShapeMap:
    """A similarity followed by a smooth displacement; or, turned round, what undoes both."""

    similarity: AffineMap
    basis: BendingBasis
    coefficients: Floats  # (k, 3)
    is_turned_round: bool = False

    def __call__(self, points: Floats) -> Floats:
        """Return where (n, 3) points of the source come to lie on the target, micrometres."""
        return self._undone(points) if self.is_turned_round else self._done(points)

    def back(self, points: Floats) -> Floats:
        """Return the (n, 3) points of the source that come to lie at points of the target."""
        return self._done(points) if self.is_turned_round else self._undone(points)

    def turned_round(self) -> ShapeMap:
        """Return the map from the target to the source."""
        return replace(self, is_turned_round=not self.is_turned_round)

    def _done(self, points: Floats) -> Floats:
        start = self.similarity(points)
        return self.basis.moved(start, self.coefficients)

    def _undone(self, points: Floats) -> Floats:
        found = self.similarity.inverse()(points)
        for _ in range(INVERSE_ROUNDS):
            here = self._done(found)
            missing = points - here
            if np.abs(missing).max(initial=0.0) < INVERSE_UM:
                break
            slope = np.stack(_slopes(self._done, found, here, tuple(np.eye(3))), axis=2)
            found = found + np.linalg.solve(slope, missing[:, :, np.newaxis])[:, :, 0]
        return np.asarray(found)

    def turned(self, points: Floats, normals: Floats) -> Floats:
        """Return the (n, 3) unit normals that a surface through points has after the map."""
        first, second = _slopes(self, points, self(points), _tangents(normals))
        sense = -1.0 if self.similarity.is_mirroring else 1.0
        return sense * _unit(np.cross(first, second))


def fit_shape_map(
    source: SurfaceMesh,
    target: SurfaceMesh,
    to_target: AffineMap,
    report: Report = ignore,
) -> ShapeMap:
    """Return the map that bends a source to lie on a target.

    Parameters
    ----------
    source, target : SurfaceMesh
        As read, micrometres.
    to_target : AffineMap
        About how the source lies on the target.

    Raises
    ------
    MeshError
        A surface encloses nothing.

    Notes
    -----
    Each round pairs points of both skins with the most similar point of the other one and solves
    min mean w |M (x + u(x) - y)|^2 + stiffness (|bending of u|^2 + STRAIN |strain of its affine
    part|^2), M the weighting of what is off along and across the surface, w small for far pairs.
    The bending energy is that of the spline in space with kernel -r. A similarity costs nothing.
    Without a price, shears of several degrees fit the outsides of smooth brains as well as none.
    How soft the last round is depends on the pair: the more two brains differ, the softer.
    Ending at stiffness |bending|^2 = PAID_UM2 is to minimise misfit + PAID_UM2 log |bending|^2,
    a price that takes no size of the bends for granted.

    References
    ----------
    Amberg, Romdhani, Vetter, Optimal step nonrigid ICP algorithms for surface registration, CVPR
    2007. Myronenko, Song, Point set registration: coherent point drift, IEEE TPAMI 32(12), 2010.
    """
    report(0.0, "bending one brain to the other")
    own, goal = find_skin(source, SAMPLES), find_skin(target, SAMPLES)
    similarity = fit_skins(
        own,
        goal,
        _nearest_similarity(to_target, own.points.mean(axis=0)),
        "similarity",
        SIMILARITY_ROUNDS,
        QUERIES,
        within(report, 0.05, 0.2),
    )
    skin = own.moved(similarity)
    basis = make_basis(skin.points)
    return ShapeMap(similarity, basis, _bend(skin, goal, basis, within(report, 0.2, 1.0)))


def _nearest_similarity(by: AffineMap, middle: Floats) -> AffineMap:
    turn, stretch = polar(by.matrix)
    matrix = np.cbrt(np.linalg.det(stretch)) * turn
    return AffineMap(matrix, by(middle) - matrix @ middle)


def _bend(skin: Skin, goal: Skin, basis: BendingBasis, report: Report) -> Floats:
    """Return the (k, 3) coefficients of the displacement that lays one skin on another."""
    values = basis(skin.points)
    tree = KDTree(goal.features)
    coefficients = np.zeros((values.shape[1], 3))
    used = N_AFFINE
    highest = 0.0
    for done, (stiffness, detail) in enumerate(zip(STIFFNESS, DETAIL, strict=True)):
        report(done / MOST_ROUNDS, "bending one brain to the other")
        some, others = (
            np.arange(0, len(points), max(1, round(len(points) / round(QUERIES * detail))))
            for points in (skin.points, goal.points)
        )
        moved = _moved(skin, basis, coefficients[:used])
        place, partner, weights = find_pairs(moved, goal.features, tree, some, others)
        used = N_AFFINE + round(detail * (len(coefficients) - N_AFFINE))
        pulled, pull, goals = _pulls(
            place,
            goal.points[partner] - skin.points[place],
            goal.normals[partner],
            weights / weights.sum(),
        )
        bent = _solve(values[pulled, :used], pull, goals, stiffness)
        if _least_volume(skin, basis, bent) < LEAST_VOLUME:
            break
        coefficients[:used] = bent
        paid = stiffness * float((coefficients[N_AFFINE:] ** 2).sum())
        highest = max(highest, paid)
        if done >= LEAST_ROUNDS and paid < min(PAID_UM2, PAST_HEIGHT * highest):
            break
    return coefficients


def _moved(skin: Skin, basis: BendingBasis, coefficients: Floats) -> Floats:
    """Return the (n, 6) features of a skin after a displacement."""
    by = partial(basis.moved, coefficients=coefficients)
    here = by(skin.points)
    first, second = _slopes(by, skin.points, here, _tangents(skin.normals))
    return np.hstack([here, NORMAL_UM * _unit(np.cross(first, second))])


def _least_volume(skin: Skin, basis: BendingBasis, coefficients: Floats) -> float:
    """Return what is left of a unit of volume where a displacement squeezes a skin most."""
    some = slice(None, None, max(1, len(skin.points) // QUERIES))
    points, normals = skin.points[some], skin.normals[some]
    by = partial(basis.moved, coefficients=coefficients)
    sides = _slopes(by, points, by(points), (*_tangents(normals), normals))
    return float(np.linalg.det(np.stack(sides, axis=1)).min())


def _slopes(
    by: Callable[[Floats], Floats], points: Floats, here: Floats, ways: Sequence[Floats]
) -> list[Floats]:
    """Return for each way how far a map goes per step of the points on that way, each (n, 3).

    Parameters
    ----------
    here : (n, 3) float
        Where the map takes the points.
    ways : sequence of (n, 3) or (3,) float
        Unit vectors.
    """
    return [(by(points + TANGENT_UM * way) - here) / TANGENT_UM for way in ways]


def _tangents(normals: Floats) -> tuple[Floats, Floats]:
    """Return two unit vectors along each surface; with the normal they are a right-handed frame."""
    least = np.abs(normals).argmin(axis=1)
    first = _unit(np.cross(normals, np.eye(3)[least]))
    return first, np.cross(normals, first)


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def _pulls(
    place: Integers, goal: Floats, normals: Floats, weights: Floats
) -> tuple[Integers, Floats, Floats]:
    """Return the places that pairs pull, and the sums of what pulls each.

    Parameters
    ----------
    place : (n,) int
        The place that each pair pulls; several pairs may pull the same.
    goal, normals : (n, 3) float
        Where it should move to, and the normal of the surface there.

    Returns
    -------
    (p,) int, (p, 3, 3) float, (p, 3) float
        The places, the sums of w M^T M, and the sums of w M^T M goal.
    """
    pulled, number = np.unique(place, return_inverse=True)
    outer = (1 - ALONG) * normals[:, :, np.newaxis] * normals[:, np.newaxis] + ALONG * np.eye(3)
    pull = weights[:, np.newaxis, np.newaxis] * outer
    goals = np.einsum("nij,nj->ni", pull, goal)
    gather = sparse.csr_array((np.ones(len(place)), (number, np.arange(len(place)))))
    sums = np.asarray(gather @ pull.reshape(-1, 9)).reshape(-1, 3, 3)
    return pulled, sums, np.asarray(gather @ goals)


def _solve(at: Floats, pull: Floats, goals: Floats, stiffness: float) -> Floats:
    """Return the (k, 3) coefficients of the displacement that is nearest to what pulls it.

    Parameters
    ----------
    at : (p, k) float
        Values of the basis at the places pulled.
    pull, goals : (p, 3, 3) and (p, 3) float
        See `_pulls`.
    """
    n_basis = at.shape[1]
    system = np.zeros((3, n_basis, 3, n_basis))
    for i in range(3):
        system[i, :, i] = _weighted_squares(at, pull[:, i, i])
    for i, j in ((0, 1), (0, 2), (1, 2)):
        # products from squares, a b = ((a + b)^2 - a^2 - b^2) / 2: squares are half the work
        both = _weighted_squares(at, pull[:, i, i] + 2 * pull[:, i, j] + pull[:, j, j])
        system[j, :, i] = (both - system[i, :, i] - system[j, :, j]) / 2
    matrix = system.reshape(3 * n_basis, 3 * n_basis)
    diagonal = np.arange(3 * n_basis).reshape(3, n_basis)
    bending = diagonal[:, N_AFFINE:].ravel()
    matrix[bending, bending] += stiffness
    straining = diagonal[:, 1:N_AFFINE].T.ravel()
    matrix[np.ix_(straining, straining)] += stiffness * STRAIN * _strain_energy()
    # only the lower blocks are filled; read by columns they are the upper ones
    factor = cho_factor(matrix.T, lower=False, overwrite_a=True, check_finite=False)
    return np.asarray(cho_solve(factor, (goals.T @ at).ravel())).reshape(3, n_basis).T


def _weighted_squares(at: Floats, weights: Floats) -> Floats:
    """Return at.T @ diag(weights) @ at for weights that are not negative, up to rounding."""
    scaled = at * np.sqrt(np.maximum(weights, 0))[:, np.newaxis]
    return np.asarray(scaled.T @ scaled)  # numpy sees one matrix and computes one triangle only


def _strain_energy() -> Floats:
    """Return the (9, 9) form of the squared strain of an affine map that keeps its volume."""
    rows = []
    for i in range(3):
        for j in range(3):
            strain = np.zeros((3, 3))
            strain[i, j] += 0.5
            strain[j, i] += 0.5
            rows.append((strain - (i == j) * np.eye(3) / 3).ravel())
    return np.asarray(np.transpose(rows) @ rows)
