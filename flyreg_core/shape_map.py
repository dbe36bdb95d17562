"""How one brain has to be bent to lie on another: a smooth map of space, from their outsides alone.

An affine map leaves the antennal lobes of one brain beside those of another. Here closest points
of the two skins, positions and normals together, bend space from stiff to soft, as far as the skins
ask for it and no further. Which places correspond along the surface, where a smooth brain shows
little, is decided by what a bend costs: both strain and bending have their price, so that nothing
is sheared that need not be.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve, polar
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

from flyreg_core.affine import AffineMap
from flyreg_core.closest_points import TOLERANCE, fit_skins
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.progress import Report, ignore, within
from flyreg_core.skin import NORMAL_UM, Skin, find_skin

SAMPLES = 16_000
"""Points drawn on each surface."""
QUERIES = 2500
"""About how many points of each skin look for a partner in each round."""
CENTERS = 300
"""Places at which space can be bent."""
SIMILARITY_ROUNDS = 40
ROUNDS = 30
STIFFNESS = np.geomspace(1.0, 1e-4, ROUNDS)
"""Price of bending in each round: at first only the whole brain bends, at last single lobes."""
DETAIL = np.geomspace(0.1, 1.0, ROUNDS)
"""Share of the bumps and of the queries that each round uses: stiff ones need no detail."""
STRAIN = 3.0
"""Price of strain of the whole brain, against 1 of bending."""
ALONG = 0.3
"""Weight of what is off along the surface, against 1 across it."""
TANGENT_UM = 1.0
"""How far apart places are by whose motion a normal is turned."""
INVERSE_ROUNDS, INVERSE_UM = 50, 1e-6
N_AFFINE = 4


@dataclass(frozen=True, eq=False)
class BendingBasis:
    """Functions of space: 1, x, y, z and bumps whose squared coefficients add up to bending energy."""

    centers: Floats  # (k, 3)
    middle: Floats  # (3,)
    scale: float  # micrometres, the length that counts as 1
    modes: Floats  # (k, k - 4)

    def __call__(self, points: Floats) -> Floats:
        """Return (n, k) values at (n, 3) points."""
        bumps = -cdist(points, self.centers) / self.scale @ self.modes
        return np.hstack([np.ones((len(points), 1)), (points - self.middle) / self.scale, bumps])


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
        return np.asarray(start + self.basis(start) @ self.coefficients)

    def _undone(self, points: Floats) -> Floats:
        undo = self.similarity.inverse()
        found = undo(points)
        for _ in range(INVERSE_ROUNDS):
            missing = points - self._done(found)
            found = found + missing @ undo.matrix.T
            if np.abs(missing).max(initial=0.0) < INVERSE_UM:
                break
        return np.asarray(found)

    def turned(self, points: Floats, normals: Floats) -> Floats:
        """Return the (n, 3) unit normals that a surface through points has after the map."""
        here = self(points)
        first, second = (self(points + TANGENT_UM * side) - here for side in _tangents(normals))
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
    basis = _basis(skin.points)
    return ShapeMap(similarity, basis, _bend(skin, goal, basis, within(report, 0.2, 1.0)))


def _nearest_similarity(by: AffineMap, middle: Floats) -> AffineMap:
    turn, stretch = polar(by.matrix)
    matrix = np.cbrt(np.linalg.det(stretch)) * turn
    return AffineMap(matrix, by(middle) - matrix @ middle)


def _basis(points: Floats) -> BendingBasis:
    centers = points[spread_out(points, CENTERS)]
    scale = float(np.ptp(points, axis=0).max())
    middle = centers.mean(axis=0)
    affine = np.column_stack([np.ones(len(centers)), (centers - middle) / scale])
    complement = np.linalg.qr(affine, mode="complete")[0][:, N_AFFINE:]
    energy = complement.T @ (-cdist(centers, centers) / scale) @ complement
    values, vectors = np.linalg.eigh(energy)  # positive: -r is conditionally so
    smoothest_first = (vectors / np.sqrt(values))[:, ::-1]
    return BendingBasis(centers, middle, scale, complement @ smoothest_first)


def spread_out(points: Floats, count: int) -> np.ndarray:
    """Return the numbers of up to `count` points, each the farthest from all before it."""
    chosen = [0]
    away = np.linalg.norm(points - points[0], axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(away.argmax()))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)


def _bend(skin: Skin, goal: Skin, basis: BendingBasis, report: Report) -> Floats:
    """Return the (k, 3) coefficients of the displacement that lays one skin on another."""
    values = [basis(skin.points)]
    values += [basis(skin.points + TANGENT_UM * side) for side in _tangents(skin.normals)]
    tree = KDTree(goal.features)
    coefficients = np.zeros((values[0].shape[1], 3))
    for done, (stiffness, detail) in enumerate(zip(STIFFNESS, DETAIL, strict=True)):
        report(done / ROUNDS, "bending one brain to the other")
        some, others = (
            slice(None, None, max(1, round(len(points) / (QUERIES * detail))))
            for points in (skin.points, goal.points)
        )
        moved = _moved(skin, values, coefficients)
        apart, there = tree.query(moved[some])
        apart_back, back = KDTree(moved).query(goal.features[others])
        away = np.concatenate([apart, apart_back])
        weights = (1 + (away / (TOLERANCE * np.median(away) + 1e-9)) ** 2) ** -2
        first = np.concatenate([skin.points[some], skin.points[back]])
        last = np.concatenate([goal.points[there], goal.points[others]])
        normals = np.concatenate([goal.normals[there], goal.normals[others]])
        at = np.concatenate([values[0][some], values[0][back]])
        used = N_AFFINE + round(detail * (len(coefficients) - N_AFFINE))
        coefficients[:used] = _solve(
            at[:, :used], last - first, normals, weights / weights.sum(), stiffness
        )
    return coefficients


def _moved(skin: Skin, values: list[Floats], coefficients: Floats) -> Floats:
    """Return the (n, 6) features of a skin after a displacement."""
    here, *sides = (at @ coefficients for at in values)
    first, second = (
        TANGENT_UM * side + there - here
        for side, there in zip(_tangents(skin.normals), sides, strict=True)
    )
    return np.hstack([skin.points + here, NORMAL_UM * _unit(np.cross(first, second))])


def _tangents(normals: Floats) -> tuple[Floats, Floats]:
    """Return two unit vectors along each surface; with the normal they are a right-handed frame."""
    least = np.abs(normals).argmin(axis=1)
    first = _unit(np.cross(normals, np.eye(3)[least]))
    return first, np.cross(normals, first)


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def _solve(at: Floats, goal: Floats, normals: Floats, weights: Floats, stiffness: float) -> Floats:
    """Return the (k, 3) coefficients of the displacement that is nearest to goals, (n, 3)."""
    n_basis = at.shape[1]
    system = np.zeros((n_basis, 3, n_basis, 3))
    for i in range(3):
        for j in range(i, 3):
            share = weights * ((1 - ALONG) * normals[:, i] * normals[:, j] + ALONG * (i == j))
            system[:, i, :, j] = system[:, j, :, i] = at.T @ (at * share[:, np.newaxis])
    across = (normals * goal).sum(axis=1)[:, np.newaxis] * normals
    right = at.T @ (weights[:, np.newaxis] * (ALONG * goal + (1 - ALONG) * across))
    matrix = system.reshape(3 * n_basis, 3 * n_basis)
    bending = np.arange(3 * N_AFFINE, 3 * n_basis)
    matrix[bending, bending] += stiffness
    matrix[3 : 3 * N_AFFINE, 3 : 3 * N_AFFINE] += stiffness * STRAIN * _strain_energy()
    return np.asarray(cho_solve(cho_factor(matrix), right.ravel())).reshape(n_basis, 3)


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
