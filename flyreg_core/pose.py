"""How a brain lies in its file: where its front, its top and its midline are, by its shape alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flyreg_core.anatomy import find_postures
from flyreg_core.frame import BrainFrame
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.occupancy import find_occupancy, find_own_axes
from flyreg_core.symmetry import find_symmetry_plane

SURE = 0.075
"""How much larger the best mean log likelihood must be than that of another posture."""


@dataclass(frozen=True)
class Pose:
    """The frame of a brain by its shape, and how far to trust it."""

    frame: BrainFrame  # never mirrored: which side is left follows from the front and the top
    likeness: float  # correlation of the surface with its mirror image, up to 1
    lead: float  # by how much it is likelier than another front or top, in mean log likelihood

    @property
    def is_sure(self) -> bool:
        """Tell whether front and top are beyond doubt."""
        return self.lead > SURE


def find_frame(mesh: SurfaceMesh) -> BrainFrame:
    """Return the frame of a brain, see `find_pose`."""
    return find_pose(mesh).frame


def find_pose(mesh: SurfaceMesh) -> Pose:
    """Return where left, ventral and posterior are in a brain that lies anyhow in its file.

    The midplane is where the inside is most like its mirror image; front and top are such that the
    parts of the brain lie where they do in the mean fly. The frame turns, moves, mirrors and scales
    with the mesh, but is right-handed even if the mesh shows a mirror image, which shape alone
    cannot tell.

    Parameters
    ----------
    mesh : SurfaceMesh
        The surface of a brain or a trimmed brain: open, torn, with sheets inside, without one optic
        lobe or both.

    Raises
    ------
    InputError
        No direction is clearly the left and right, as in a ball, or nothing is enclosed.
    """
    own = find_own_axes(mesh)
    occupancy = find_occupancy(mesh, own)
    plane = find_symmetry_plane(occupancy)
    across = np.linalg.svd(plane.normal[np.newaxis])[2][1:]
    points, share = occupancy.halved().filled()
    lateral = np.abs(points @ plane.normal - plane.height)
    best, *others = find_postures(lateral, points @ across.T, share)
    origin = plane.height * plane.normal + best.center @ across
    ventral, posterior = (side @ across @ own.axes for side in (best.ventral, best.posterior))
    axes = np.stack([np.cross(ventral, posterior), ventral, posterior])
    lead = min(
        (
            best.log_likelihood - other.log_likelihood
            for other in others
            if other.ventral @ best.ventral < 0.7 or other.posterior @ best.posterior < 0.7
        ),
        default=np.inf,
    )
    return Pose(BrainFrame(own.points(origin), axes), plane.likeness, float(lead))
