"""Optimal step non-rigid ICP: every vertex has an affine map of its own, like its neighbours'."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.progress import Report
from flyreg_core.rivals.closest_point_methods import closest_points_affine
from flyreg_core.rivals.rival import Moved, SpaceMap, moved_by
from flyreg_core.transform import transform_points

NORMALS = 0.5
"""How much a pair counts whose normals differ: the cosine to this power, the package's own."""


@dataclass(frozen=True)
class Round:
    """What is done with so many vertices of the source; the others go along with its faces."""

    vertices: int
    stiffness: tuple[float, ...]  # of one step after the other, for a source of unit size
    most_solutions: int  # of each step


ROUNDS = (Round(3000, (10.0, 1.0, 0.1, 0.01), 10), Round(8000, (0.001,), 3))
"""From stiff to soft, as the authors ask for, until the package's own error settles. Its own steps
have stiffness 0.01 to 0.03 and end at 0.01: made for landmarks to lead them, they leave 3 % of a
smooth bend and half of a turn by 3 degrees. The second round is ours: after the first alone,
what is between the vertices lies several times farther from the target than they do."""


def bend_mesh(
    source: SurfaceMesh, target: SurfaceMesh, report: Report, rounds: tuple[Round, ...] = ROUNDS
) -> Moved:
    """Return the source bent onto the target, after iterative closest points have laid it there.

    References
    ----------
    Amberg, Romdhani, Vetter, Optimal step nonrigid ICP algorithms for surface registration, CVPR
    2007, doi:10.1109/CVPR.2007.383165; as `trimesh.registration.nricp_amberg` has it.
    """
    import rtree  # noqa: F401 - trimesh needs it, and says so only when it is far

    report(0.0, "reducing the mesh")
    starts = [source]
    for each in reversed(rounds):  # each from the next: the finest takes longest
        starts.insert(0, _reduced(starts[0], each.vertices))
    laid = closest_points_affine(starts[0], target, report)
    moved = moved_by(laid.carry, source)
    for done, (each, start) in enumerate(zip(rounds, starts, strict=False)):
        report(done / len(rounds), "bending the mesh")
        moved = moved_by(_bent(start, moved.carry(start.vertices), target, each), source)
    return moved


def _bent(start: SurfaceMesh, vertices: Floats, target: SurfaceMesh, each: Round) -> SpaceMap:
    """Return how points near a mesh go along when it is bent further, from where its vertices are."""
    from trimesh import Trimesh
    from trimesh.registration import nricp_amberg

    bent = nricp_amberg(  # type: ignore[no-untyped-call]
        Trimesh(vertices, start.faces, process=False),
        Trimesh(target.vertices, target.faces, process=False),
        steps=[(stiffness, 0.0, NORMALS, each.most_solutions) for stiffness in each.stiffness],
    )
    end = start.moved(np.asarray(bent))

    def carry(points: Floats) -> Floats:
        return transform_points(points, start, end, np.inf).points

    return carry


def _reduced(mesh: SurfaceMesh, vertices: int) -> SurfaceMesh:
    """Return a mesh of as many vertices as the method is given, of the same topology."""
    import igl

    if len(mesh.vertices) <= vertices:
        return mesh
    share = vertices / len(mesh.vertices)
    kept, faces, *_ = igl.qslim(mesh.vertices, mesh.faces, round(share * len(mesh.faces)))
    return SurfaceMesh(kept, faces.astype(np.int64))
