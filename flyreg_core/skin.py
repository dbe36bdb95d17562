"""The outside of a brain as points with normals: what is compared when one brain is laid on another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from flyreg_core.affine import AffineMap
from flyreg_core.errors import MeshError
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.winding_number import winding_numbers

DEPTH = 0.004
"""How far above and below a surface it is asked whether that is inside, in box diagonals."""
NEIGHBOURS = 8
"""Points whose normals are averaged, so that the roughness of a mesh does not count."""
NORMAL_UM = 40.0
"""Points whose normals form a right angle are as unlike as points 1.4 times this far apart."""


@dataclass(frozen=True, eq=False)
class Skin:
    """Points spread evenly over the outside of a brain."""

    points: Floats  # (n, 3), micrometres
    normals: Floats  # (n, 3), unit vectors that point outwards

    @property
    def features(self) -> Floats:
        """(n, 6) positions and weighted normals; close rows belong together."""
        return np.hstack([self.points, NORMAL_UM * self.normals])

    def moved(self, by: AffineMap) -> Skin:
        """Return where an affine map takes the skin."""
        normals = self.normals @ np.linalg.inv(by.matrix)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return Skin(by(self.points), normals / length)


def find_skin(mesh: SurfaceMesh, samples: int) -> Skin:
    """Return points of a surface that have the inside below and the outside above.

    Sheets within a brain, which many segmentations have, are thereby left out.

    Parameters
    ----------
    samples : int
        Points drawn from the whole surface, evenly by area.

    Raises
    ------
    MeshError
        The surface encloses nothing.
    """
    points, normals = _sample(mesh, samples)
    step = DEPTH * mesh.diagonal * normals
    both_sides = np.vstack([points + step, points - step])
    above, below = np.split(np.abs(winding_numbers(both_sides, mesh.vertices, mesh.faces)) > 0.5, 2)
    is_outer = above != below
    if is_outer.sum() < NEIGHBOURS:
        raise MeshError("the surface encloses nothing, so it cannot be laid on another")
    outward = np.where(above, -1.0, 1.0)[:, np.newaxis] * normals
    points, outward = points[is_outer], outward[is_outer]
    around = KDTree(points, balanced_tree=False).query(points, NEIGHBOURS)[1]
    same_side = np.einsum("ikj,ij->ik", outward[around], outward) > 0
    smooth = np.einsum("ikj,ik->ij", outward[around], same_side)
    return Skin(points, smooth / np.linalg.norm(smooth, axis=1, keepdims=True))


def _sample(mesh: SurfaceMesh, samples: int) -> tuple[Floats, Floats]:
    """Return (samples, 3) points, one in each of as many equal shares of the area, and normals."""
    cumulative = np.cumsum(mesh.face_areas)
    number = np.arange(samples)
    position = (number + 0.5) / samples * cumulative[-1]
    face = np.minimum(np.searchsorted(cumulative, position, side="right"), len(cumulative) - 1)
    # a sequence that fills the unit square evenly (Roberts 2018), folded into the triangle
    square = (number[:, np.newaxis] * [0.7548776662466927, 0.5698402909980532]) % 1
    square = np.where(square.sum(axis=1, keepdims=True) > 1, 1 - square, square)
    barycentric = np.column_stack([1 - square.sum(axis=1), square])
    points = np.einsum("ij,ijk->ik", barycentric, mesh.vertices[mesh.faces[face]])
    normals = mesh.face_normals[face]
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True)
