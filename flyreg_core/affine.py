"""Affine maps of space, and those that fit pairs of points best."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flyreg_core.mesh import Floats, SurfaceMesh


@dataclass(frozen=True, eq=False)
class AffineMap:
    """Takes a point x to `matrix` x + `offset`."""

    matrix: Floats  # (3, 3)
    offset: Floats  # (3,), micrometres

    def __call__(self, points: Floats) -> Floats:
        """Return where (..., 3) points come to lie."""
        return np.asarray(points @ self.matrix.T + self.offset)

    @property
    def is_mirroring(self) -> bool:
        """Tell whether left and right change places."""
        return bool(np.linalg.det(self.matrix) < 0)

    def inverse(self) -> AffineMap:
        """Return the map that takes everything back."""
        matrix = np.linalg.inv(self.matrix)
        return AffineMap(np.asarray(matrix, dtype=float), -matrix @ self.offset)

    def after(self, first: AffineMap) -> AffineMap:
        """Return the map that does `first` and then this one."""
        return AffineMap(self.matrix @ first.matrix, self(first.offset))


def fit_similarity(
    start: Floats, end: Floats, weights: Floats, is_scaled: bool, is_mirroring: bool
) -> AffineMap:
    """Return the turn and shift that take (n, 3) points closest to others, in weighted squares.

    Parameters
    ----------
    is_scaled : bool
        Whether the size may change too.
    is_mirroring : bool
        Whether the turn is one with reflection; which of both is never chosen by the fit.

    References
    ----------
    Umeyama, Least-squares estimation of transformation parameters between two point patterns, IEEE
    TPAMI 13(4), 1991, doi:10.1109/34.88573.
    """
    share = weights / weights.sum()
    middle, goal = share @ start, share @ end
    spread = start - middle
    left, size, right = np.linalg.svd((end - goal).T @ (share[:, np.newaxis] * spread))
    sense = np.linalg.det(left @ right) * (-1 if is_mirroring else 1)
    signs = np.array([1.0, 1.0, np.sign(sense)])
    matrix = (left * signs) @ right
    if is_scaled:
        matrix *= size @ signs / (share @ (spread**2).sum(axis=1))
    return AffineMap(matrix, goal - matrix @ middle)


def best_affine(surface: SurfaceMesh, ends: Floats) -> AffineMap:
    """Return the affine map that takes a surface closest to where its (n, 3) vertices went.

    Vertices count as much as the area around them.
    """
    middle = surface.vertices.mean(axis=0)
    known = np.column_stack([surface.vertices - middle, np.ones(len(ends))])
    root = np.sqrt(surface.vertex_areas)[:, np.newaxis]
    rows = np.linalg.lstsq(root * known, root * ends, rcond=None)[0]
    return AffineMap(np.asarray(rows[:3].T), np.asarray(rows[3] - middle @ rows[:3]))


def fit_affine(
    start: Floats, end: Floats, normals: Floats, weights: Floats, along: float
) -> AffineMap:
    """Return the affine map that takes (n, 3) points closest to surfaces at others.

    Parameters
    ----------
    normals : (n, 3) float
        Unit normals of the surfaces at `end`.
    along : float
        Weight of squares of what is off along the surface, against 1 across it; positive.
    """
    middle = start.mean(axis=0)
    scale = float(np.abs(start - middle).max())
    place = np.column_stack([(start - middle) / scale, np.ones(len(start))])
    # squares of n . r and of r are squares of these three rows times r, up to a factor
    rows = normals[:, :, np.newaxis] * normals[:, np.newaxis] * (1 - np.sqrt(along))
    rows += np.sqrt(along) * np.eye(3)
    rows *= np.sqrt(weights)[:, np.newaxis, np.newaxis]
    system = np.einsum("ia,ikj->ikaj", place, rows).reshape(-1, 12)
    values = np.einsum("ikj,ij->ik", rows, end).ravel()
    found = np.linalg.solve(system.T @ system, system.T @ values).reshape(4, 3)
    matrix = found[:3].T / scale
    return AffineMap(matrix, found[3] - matrix @ middle)
