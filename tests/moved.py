"""The same brain lying otherwise in its file: turned, moved, mirrored, larger or smaller."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from flyreg_core.handles import HandleParameters
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.pose import find_frame
from flyreg_core.progress import ignore
from flyreg_core.solid import SolidParameters, voxelize
from flyreg_core.torus import Torus, make_torus
from flyreg_core.trim import TrimParameters

SCALES = (0.5, 1.8)
FAR = 3000.0


@dataclass(frozen=True, eq=False)
class Move:
    """A rotation or reflection, a change of size, and a shift."""

    turn: NDArray[np.float64]
    scale: float
    shift: NDArray[np.float64]

    @classmethod
    def random(cls, seed: int) -> Move:
        """Return any move; those of odd seeds mirror."""
        rng = np.random.default_rng(seed)
        turn = Rotation.random(random_state=seed).as_matrix()
        if seed % 2:
            turn[rng.integers(3)] *= -1
        return cls(turn, rng.uniform(*SCALES), rng.uniform(-FAR, FAR, 3))

    def moved(self, mesh: SurfaceMesh) -> SurfaceMesh:
        """Return a surface moved, its faces seen from outside."""
        is_mirrored = np.linalg.det(self.turn) < 0
        faces = mesh.faces[:, ::-1] if is_mirrored else mesh.faces
        return SurfaceMesh(self.scale * mesh.vertices @ self.turn.T + self.shift, faces)

    def undone(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return where moved points came from."""
        return np.asarray((points - self.shift) @ self.turn / self.scale)


def as_torus(mesh: SurfaceMesh) -> Torus:
    """Take a surface through the stages up to the torus, in the frame found."""
    solid = voxelize(mesh, find_frame(mesh), SolidParameters(), ignore)
    return make_torus(mesh, solid, TrimParameters(), HandleParameters(), ignore)


def farthest_apart(a: SurfaceMesh, b: SurfaceMesh) -> float:
    """Return the largest distance from a vertex of either surface to the other."""
    return float(vertices_apart(a, b).max())


def vertices_apart(a: SurfaceMesh, b: SurfaceMesh) -> NDArray[np.float64]:
    """Return (n,) the distances from all vertices of either surface to the other."""
    square = [
        igl.point_mesh_squared_distance(one.vertices, other.vertices, other.faces)[0]
        for one, other in ((a, b), (b, a))
    ]
    return np.sqrt(np.concatenate(square))
