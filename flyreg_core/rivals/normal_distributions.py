"""Normal distributions transform: the target as normal distributions in the cells of a grid.

No maintained package with wheels for all platforms has it (small_gicp's VGICP is a relative), so it
is written here after its sources.

References
----------
Biber, Strasser, The normal distributions transform: a new approach to laser scan matching, IROS
2003, doi:10.1109/IROS.2003.1249285. Magnusson, The three-dimensional normal-distributions transform,
thesis, Oerebro University 2009, chapter 6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.spatial.transform import Rotation

from flyreg_core.affine import AffineMap
from flyreg_core.mesh import Floats, Integers, SurfaceMesh
from flyreg_core.progress import Report, within
from flyreg_core.rivals.rival import Moved, moved_by

CELLS_ALONG_DIAGONAL = (6, 12, 24, 48)
"""Cells along the target's diagonal, from coarse to fine."""
FEWEST_POINTS = 6
"""A cell of fewer has no distribution."""
SMALLEST_SHARE = 0.01
"""Variances are at least this share of the cell's largest (Magnusson 6.2.1)."""
LEAST_HELD = 0.5
"""A grid is used if at least this share of the target's points lies in cells with distributions."""
DECAY = 0.433
"""d of the score exp(-d q / 2) for 0.55 outliers and a cell of unit length (Magnusson 6.8)."""
BESIDE = np.array([(0, 0, 0), (-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1)])
"""The cells in which a point counts, from its own."""
MOST_ROUNDS, MOST_HALVINGS = 35, 6
CONVERGED = 1e-3
"""A step that moves no point farther, in cells, is the last."""


@dataclass(frozen=True, eq=False)
class Distributions:
    """The normal distributions in the cells of a grid."""

    corner: Floats  # (3,), of the grid
    cell_um: float
    shape: Integers  # (3,), cells along each axis, with one empty layer around
    number_of: Integers  # (cells,), which distribution is in each cell, -1: none
    means: Floats  # (k, 3)
    precisions: Floats  # (k, 3, 3), inverse covariances


def fit_distributions(source: SurfaceMesh, target: SurfaceMesh, report: Report) -> Moved:
    """Return the source turned and shifted to where its vertices are likeliest.

    Each vertex counts in the cell that it lies in and the six beside it, so that the score has no
    steps; Newton's method with the Gauss-Newton matrix and halved steps, on finer and finer grids.
    """
    found = AffineMap(np.eye(3), np.zeros(3))
    for level, along in enumerate(CELLS_ALONG_DIAGONAL):
        part = within(
            report, level / len(CELLS_ALONG_DIAGONAL), (level + 1) / len(CELLS_ALONG_DIAGONAL)
        )
        grid = find_distributions(target.vertices, target.diagonal / along)
        if grid is not None:
            found = _climbed(found, source.vertices, grid, part)
    return moved_by(found, source)


def find_distributions(points: Floats, cell_um: float) -> Distributions | None:
    """Return the distributions of (n, 3) points; None if too few of these lie in cells with one."""
    corner = points.min(axis=0) - cell_um
    place = np.floor((points - corner) / cell_um).astype(np.int64)
    shape = place.max(axis=0) + 2
    cells, of_point = np.unique(np.ravel_multi_index(tuple(place.T), shape), return_inverse=True)
    count = np.bincount(of_point)
    is_kept = count >= FEWEST_POINTS
    if count[is_kept].sum() < LEAST_HELD * len(points):
        return None
    means = np.zeros((len(cells), 3))
    np.add.at(means, of_point, points)
    means /= count[:, np.newaxis]
    away = points - means[of_point]
    covariances = np.zeros((len(cells), 3, 3))
    np.add.at(covariances, of_point, away[:, :, np.newaxis] * away[:, np.newaxis])
    covariances = covariances[is_kept] / (count[is_kept] - 1)[:, np.newaxis, np.newaxis]
    variances, axes = np.linalg.eigh(covariances)
    variances = np.maximum(variances, SMALLEST_SHARE * variances[:, -1:])
    precisions = np.einsum("kia,ka,kja->kij", axes, 1 / variances, axes)
    number_of = np.full(int(np.prod(shape)), -1)
    number_of[cells[is_kept]] = np.arange(is_kept.sum())
    return Distributions(corner, cell_um, shape, number_of, means[is_kept], precisions)


def _climbed(start: AffineMap, points: Floats, grid: Distributions, report: Report) -> AffineMap:
    """Return the rigid map near `start` under which the points score most."""
    found, size = start, float(np.ptp(points, axis=0).max()) / grid.cell_um
    for done in range(MOST_ROUNDS):
        report(done / MOST_ROUNDS, "fitting normal distributions")
        middle = found(points).mean(axis=0)
        score, gradient, curvature = _score(found(points), middle, grid)
        step = np.linalg.solve(curvature + 1e-9 * np.trace(curvature) * np.eye(6), gradient)
        for _ in range(MOST_HALVINGS):
            tried = _turned(step, middle, grid.cell_um).after(found)
            if _score(tried(points), middle, grid)[0] >= score:
                break
            step /= 2
        else:
            return found
        found = tried
        if np.abs(step[:3]).max() * size + np.abs(step[3:]).max() < CONVERGED:
            break
    return found


def _turned(step: Floats, middle: Floats, cell_um: float) -> AffineMap:
    """Return the turn about `middle` and the shift, in cells, of a step."""
    turn = Rotation.from_rotvec(step[:3]).as_matrix()
    return AffineMap(turn, middle - turn @ middle + cell_um * step[3:])


def _score(points: Floats, middle: Floats, grid: Distributions) -> tuple[float, Floats, Floats]:
    """Return the score of (n, 3) points, its gradient and minus its curvature, by turn and shift."""
    score, gradient, curvature = _sums(
        (points - grid.corner) / grid.cell_um,
        (middle - grid.corner) / grid.cell_um,
        grid.shape,
        grid.number_of,
        (grid.means - grid.corner) / grid.cell_um,
        grid.precisions * grid.cell_um**2,
    )
    return score, gradient, curvature


@njit(nogil=True, cache=True)
def _sums(
    points: Floats,
    middle: Floats,
    shape: Integers,
    number_of: Integers,
    means: Floats,
    precisions: Floats,
) -> tuple[float, Floats, Floats]:
    """Return the sum of exp(-DECAY q / 2), q the squared Mahalanobis distance, and derivatives.

    All in cells. The curvature is that of q alone (Gauss-Newton), so it is never negative.
    """
    score, gradient, curvature = 0.0, np.zeros(6), np.zeros((6, 6))
    slopes = np.zeros((6, 3))  # how a point moves with turn and shift
    slopes[3, 0] = slopes[4, 1] = slopes[5, 2] = 1.0
    pulls, away = np.zeros((6, 3)), np.zeros(3)
    for n in range(len(points)):
        x, y, z = points[n, 0] - middle[0], points[n, 1] - middle[1], points[n, 2] - middle[2]
        slopes[0, 1], slopes[0, 2] = -z, y
        slopes[1, 0], slopes[1, 2] = z, -x
        slopes[2, 0], slopes[2, 1] = -y, x
        for step in range(len(BESIDE)):
            cell, is_inside = 0, True  # its number, row by row
            for i in range(3):
                place = int(np.floor(points[n, i])) + BESIDE[step, i]
                is_inside &= 0 <= place < shape[i]
                cell = cell * shape[i] + place
            number = number_of[cell] if is_inside else -1
            if number < 0:
                continue
            precision, distance = precisions[number], 0.0
            for i in range(3):
                away[i] = points[n, i] - means[number, i]
            for i in range(3):
                for j in range(3):
                    distance += away[i] * precision[i, j] * away[j]
            likeness = np.exp(-DECAY / 2 * distance)
            score += likeness
            for a in range(6):
                for i in range(3):
                    pulls[a, i] = likeness * (
                        precision[i, 0] * slopes[a, 0]
                        + precision[i, 1] * slopes[a, 1]
                        + precision[i, 2] * slopes[a, 2]
                    )
                    gradient[a] -= pulls[a, i] * away[i]
                for b in range(a + 1):
                    for i in range(3):
                        curvature[a, b] += pulls[a, i] * slopes[b, i]
    return score, gradient, curvature + np.tril(curvature, -1).T
