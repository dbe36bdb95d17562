"""Stage 3b: the averaging of the Loop subdivision's limit, passed over the surface many times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from flyreg_core.errors import MeshError
from flyreg_core.mesh import Floats, Integers
from flyreg_core.progress import Report
from flyreg_core.topology import unique_edges

PASSES_PER_REPORT = 25


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
    smoothed = np.array(vertices)
    for done in range(parameters.passes):
        if done % PASSES_PER_REPORT == 0:
            report(done / parameters.passes, "smoothing the surface")
        smoothed = matrix @ smoothed
    return smoothed
