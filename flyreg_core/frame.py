"""The frame of the animal: where left, ventral and posterior lie in the coordinates of a file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flyreg_core.mesh import Floats

LEFT_RIGHT, DORSO_VENTRAL, ANTERO_POSTERIOR = 0, 1, 2
"""Columns of coordinates in a frame; they grow towards the left, ventrally and posteriorly."""


@dataclass(frozen=True, eq=False)
class BrainFrame:
    """An origin amid the brain and three perpendicular unit vectors, in the file's coordinates.

    As in the images that the field's templates come from, coordinates grow towards the animal's
    left, ventrally and posteriorly: the first slice is the most anterior, the first row the most
    dorsal, and whoever looks at it faces the fly.
    """

    origin: Floats  # (3,), on the midplane, micrometres
    axes: Floats  # (3, 3), rows point to the animal's left, ventrally and posteriorly

    def coordinates(self, points: Floats) -> Floats:
        """Return (..., 3) points of the file in the frame, micrometres."""
        return np.asarray((points - self.origin) @ self.axes.T)

    def points(self, coordinates: Floats) -> Floats:
        """Return where (..., 3) coordinates of the frame lie in the file, micrometres."""
        return np.asarray(self.origin + coordinates @ self.axes)

    @property
    def outwards(self) -> float:
        """-1 where normals of prepared faces point inwards in the file, as it is mirrored; else 1."""
        return -1.0 if self.is_mirrored else 1.0

    @property
    def is_mirrored(self) -> bool:
        """Tell whether the file shows the animal's mirror image."""
        return bool(np.linalg.det(self.axes) < 0)

    def mirrored(self) -> BrainFrame:
        """Return the frame with left and right exchanged."""
        return BrainFrame(self.origin, self.axes * [[-1.0], [1.0], [1.0]])

    @property
    def anterior(self) -> Floats:
        """Unit vector that points out of the front of the brain."""
        return np.asarray(-self.axes[ANTERO_POSTERIOR])

    @property
    def dorsal(self) -> Floats:
        """Unit vector that points out of the top of the brain."""
        return np.asarray(-self.axes[DORSO_VENTRAL])
