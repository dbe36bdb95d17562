"""Optimal step non-rigid ICP: every vertex has an affine map of its own, like its neighbours'."""

from __future__ import annotations

import numpy as np

from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.progress import Report
from flyreg_core.rivals.rival import Moved, moved_by
from flyreg_core.transform import transform_points

COARSE_VERTICES = 3000
"""Vertices of the source that are moved by the method; the others go along with its faces."""


def bend_mesh(source: SurfaceMesh, target: SurfaceMesh, report: Report) -> Moved:
    """Return the source bent onto the target; the steps are the package's own.

    References
    ----------
    Amberg, Romdhani, Vetter, Optimal step nonrigid ICP algorithms for surface registration, CVPR
    2007, doi:10.1109/CVPR.2007.383165; as `trimesh.registration.nricp_amberg` has it.
    """
    import rtree  # noqa: F401 - trimesh needs it, and says so only when it is far
    from trimesh import Trimesh
    from trimesh.registration import nricp_amberg

    report(0.0, "bending the mesh")
    coarse = _reduced(source)
    vertices = nricp_amberg(  # type: ignore[no-untyped-call]
        Trimesh(coarse.vertices, coarse.faces, process=False),
        Trimesh(target.vertices, target.faces, process=False),
    )
    bent = coarse.moved(np.asarray(vertices))

    def carry(points: Floats) -> Floats:
        return transform_points(points, coarse, bent, np.inf).points

    return moved_by(carry, source)


def _reduced(mesh: SurfaceMesh) -> SurfaceMesh:
    """Return a mesh of as many vertices as the method is given, of the same topology."""
    import igl

    if len(mesh.vertices) <= COARSE_VERTICES:
        return mesh
    share = COARSE_VERTICES / len(mesh.vertices)
    vertices, faces, *_ = igl.qslim(mesh.vertices, mesh.faces, round(share * len(mesh.faces)))
    return SurfaceMesh(vertices, faces.astype(np.int64))
