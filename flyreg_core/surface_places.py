"""The places of a surface that are nearest to points of space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flyreg_core.mesh import Floats, Integers, SurfaceMesh


@dataclass(frozen=True, eq=False)
class SurfacePlaces:
    """Places on the faces of a surface."""

    points: Floats  # (n, 3), micrometres
    face: Integers  # (n,)
    barycentric: Floats  # (n, 3), of the places in their faces
    apart_um: Floats  # (n,) between each place and the point it is nearest to

    def carried(self, values: Floats, faces: Integers) -> Floats:
        """Return the (n, k) values at the places, of which the vertices of the faces have (v, k)."""
        return np.asarray(np.einsum("ij,ijk->ik", self.barycentric, values[faces[self.face]]))


def find_places(points: Floats, surface: SurfaceMesh) -> SurfacePlaces:
    """Return the places of a surface nearest to (n, 3) points."""
    squared, face, barycentric = surface.tree.nearest(points)
    nearest = np.einsum("ij,ijk->ik", barycentric, surface.vertices[surface.faces[face]])
    return SurfacePlaces(nearest, face, barycentric, np.sqrt(squared))
