"""Stage 3b: the averaging of the Loop subdivision's limit, passed over the surface many times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import sparse

from flyreg_core.errors import MeshError
from flyreg_core.mesh import Floats, Integers
from flyreg_core.progress import Report
from flyreg_core.topology import unique_edges

PRODUCTS_PER_REPORT = 10
NEGLIGIBLE = 1e-16
"""Share of the passes' outcome that is left out, on either side."""


@dataclass(frozen=True)
class SmoothParameters:
    """How many averaging passes; the paper's curves are flat after about 400 and it takes 500."""

    passes: int = 500


def averaging_matrix(faces: Integers, n_vertices: int) -> sparse.csr_array:
    """Return the (n, n) matrix of one pass: v <- (alpha(n) v + sum of neighbours) / (alpha(n) + n).

    alpha = n (1 - beta) / beta, beta = 5/4 - (3 + 2 cos(2 pi / n))^2 / 32, n the number of
    neighbours (eq. 1, 3, 4). Rows sum to 1; a vertex without neighbours stays.
    """
    edges, _ = unique_edges(faces)
    both = np.concatenate([edges, edges[:, ::-1]])
    count = np.bincount(both[:, 0], minlength=n_vertices).astype(float)
    n = np.maximum(count, 1)
    beta = 5 / 4 - (3 + 2 * np.cos(2 * np.pi / n)) ** 2 / 32
    alpha = n * (1 - beta) / beta
    own = np.where(count > 0, alpha / (alpha + n), 1.0)
    values = np.concatenate([1 / (alpha + n)[both[:, 0]], own])
    diagonal = np.arange(n_vertices)
    rows = np.concatenate([both[:, 0], diagonal])
    columns = np.concatenate([both[:, 1], diagonal])
    return sparse.csr_array((values, (rows, columns)), shape=(n_vertices, n_vertices))


def smooth(
    vertices: Floats, faces: Integers, parameters: SmoothParameters, report: Report
) -> Floats:
    """Return the (n, 3) vertices after the averaging passes (3.1 C of the paper).

    Raises
    ------
    MeshError
        The number of passes is negative.
    """
    if parameters.passes < 0:
        raise MeshError(
            f"the number of smoothing passes must be at least 0, not {parameters.passes}"
        )
    matrix = averaging_matrix(faces, len(vertices))
    return averaged(matrix, np.array(vertices), parameters.passes, report)


def averaged(matrix: sparse.csr_array, values: Floats, passes: int, report: Report) -> Floats:
    """Return what many passes make of values, `matrix` to the power of `passes` @ `values`.

    Parameters
    ----------
    matrix : (n, n) sparse
        An averaging matrix: its eigenvalues are real and lie between -1 and 1.
    values : (n, 3) float

    Notes
    -----
    x^m is the mean of T_|s|(x), T Chebyshev's polynomials, over the end s of a random walk of m
    steps +1 or -1. Ends beyond about 8.6 sqrt(m) have no weight that a float could show, so that
    500 passes take 192 products. The polynomials are at most 1 in size, so no error grows.

    References
    ----------
    Sachdeva, Vishnoi, Faster algorithms via approximation theory, Foundations and Trends in
    Theoretical Computer Science 9(2), 2014, doi:10.1561/0400000065, theorem 3.1.
    """
    shares = _shares_of_degrees(passes)
    before, here, total = np.zeros_like(values), values.copy(), shares[0] * values
    rows = matrix.indptr.astype(np.int32), matrix.indices.astype(np.int32), matrix.data
    for degree in range(1, len(shares)):
        if degree % PRODUCTS_PER_REPORT == 1:
            report(degree / len(shares), "smoothing the surface")
        _next_degree(*rows, 1.0 if degree == 1 else 2.0, here, before, shares[degree], total)
        before, here = here, before
    return np.asarray(total)


def _shares_of_degrees(passes: int) -> Floats:
    """Return how much each of Chebyshev's polynomials counts in x to the power of `passes`."""
    ups = np.arange((passes + 1) // 2, passes)  # steps up of walks that end at 2 ups - passes
    shares = np.zeros(passes + 1)
    shares[passes % 2 :: 2] = np.cumprod(np.append(1.0, (passes - ups) / (ups + 1)))
    shares[1:] *= 2  # ends on either side
    shares /= shares.sum()
    beyond = np.cumsum(shares[::-1])[::-1]
    return np.asarray(shares[: np.count_nonzero(beyond > NEGLIGIBLE)])


@njit(nogil=True, cache=True)
def _next_degree(
    start: NDArray[np.int32],
    columns: NDArray[np.int32],
    weights: Floats,
    factor: float,
    here: Floats,
    before: Floats,
    share: float,
    total: Floats,
) -> None:
    """Replace `before` by factor * matrix @ here - before, and add a share of it to the total."""
    for row in range(len(here)):
        x = y = z = 0.0
        for k in range(start[row], start[row + 1]):
            weight, column = weights[k], columns[k]
            x += weight * here[column, 0]
            y += weight * here[column, 1]
            z += weight * here[column, 2]
        for i, mean in enumerate((x, y, z)):
            before[row, i] = factor * mean - before[row, i]
            total[row, i] += share * before[row, i]
