"""Frames to try things in, and brains that lie in their files as a frame says."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from flyreg_core.frame import BrainFrame
from flyreg_core.mesh import SurfaceMesh

UPRIGHT = BrainFrame(np.zeros(3), np.eye(3))
"""The file's own axes: a frame in which coordinates are what the file says."""
FAR = 1000.0


def random_frame(seed: int, is_mirrored: bool = False) -> BrainFrame:
    """Return axes turned anyhow, and mirrored if asked for, about an origin up to `FAR` away."""
    rng = np.random.default_rng(seed)
    axes = Rotation.random(random_state=seed).as_matrix()
    if is_mirrored:
        axes[rng.integers(3)] *= -1
    return BrainFrame(rng.uniform(-FAR, FAR, 3), axes)


def laid(mesh: SurfaceMesh, frame: BrainFrame) -> SurfaceMesh:
    """Return a brain given in its own frame as it lies in a file, its faces seen from outside."""
    faces = mesh.faces[:, ::-1] if frame.is_mirrored else mesh.faces
    return SurfaceMesh(frame.points(mesh.vertices), faces)
