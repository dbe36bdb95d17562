"""How triangles change from one shape of a surface to another: in area and in angles.

Both are logarithms to base 2, so that they are 0 where nothing changes, opposite for opposite
changes, and add up over stages (the area exactly, the angles at most).
"""

from __future__ import annotations

import numpy as np

from flyreg_core.mesh import Floats, Integers

SMALLEST = 1e-30
"""Squared lengths and areas below this count as it: a collapsed triangle has no finite logarithm."""


def log_area_ratios(before: Floats, after: Floats) -> Floats:
    """Return log2 of how many times larger (m, 3, d) triangles become; 1 is twice as large.

    `before` and `after` may lie in space (d = 3) or in the plane (d = 2); which side a triangle
    shows does not count.
    """
    old, new = _areas(_edges(before)), _areas(_edges(after))
    return np.asarray(np.log2(np.maximum(new, SMALLEST)) - np.log2(np.maximum(old, SMALLEST)))


def log_dilatations(before: Floats, after: Floats) -> Floats:
    """Return log2 of how many times more (m, 3, d) triangles are stretched one way than the other.

    0 where all angles are kept, 1 where a circle becomes an ellipse twice as long as wide.

    Notes
    -----
    With the triangle's metric before, g = Eᵀ E of its edges E, and after, h, the stretches are the
    roots of the eigenvalues of g⁻¹ h; their quotient K is the quasi-conformal dilatation, and
    K + 1/K = tr(adj(g) h) / sqrt(det g det h).

    References
    ----------
    Sander, Snyder, Gortler, Hoppe, Texture mapping progressive meshes, SIGGRAPH 2001, section 3.
    """
    g, h = _metrics(_edges(before)), _metrics(_edges(after))
    trace = g[:, 1] * h[:, 0] - 2 * g[:, 2] * h[:, 2] + g[:, 0] * h[:, 1]
    determinants = [m[:, 0] * m[:, 1] - m[:, 2] ** 2 for m in (g, h)]
    root = np.sqrt(np.maximum(determinants[0], SMALLEST) * np.maximum(determinants[1], SMALLEST))
    half = np.maximum(trace / (2 * root), 1.0)
    return np.asarray(np.arccosh(half) / np.log(2))


def to_vertices(values: Floats, faces: Integers, weights: Floats, n_vertices: int) -> Floats:
    """Return the (n,) means of (m,) values of the faces around each vertex; NaN where there is none.

    Parameters
    ----------
    weights : (m,) float
        How much each face counts, such as its area.
    """
    corners = faces.reshape(-1)
    total = np.bincount(corners, np.repeat(weights, 3), n_vertices)
    summed = np.bincount(corners, np.repeat(weights * values, 3), n_vertices)
    return np.asarray(np.divide(summed, total, out=np.full(n_vertices, np.nan), where=total > 0))


def _edges(corners: Floats) -> tuple[Floats, Floats]:
    return corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]


def _metrics(edges: tuple[Floats, Floats]) -> Floats:
    """Return (m, 3): the squared lengths of both edges, and their product."""
    p, q = edges
    return np.stack(
        [np.einsum("ij,ij->i", a, b) for a, b in ((p, p), (q, q), (p, q))],
        axis=1,
    )


def _areas(edges: tuple[Floats, Floats]) -> Floats:
    pp, qq, pq = _metrics(edges).T
    return np.asarray(np.sqrt(np.maximum(pp * qq - pq**2, 0.0)) / 2)
