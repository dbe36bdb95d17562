"""Where a camera stands relative to a brain, and the link that keeps several brains in step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject

from flyreg_core.frame import BrainFrame
from flyreg_core.mesh import SurfaceMesh

if TYPE_CHECKING:
    from flyreg_gui.views.surface_view import SurfaceView

Floats = NDArray[np.float64]

VIEW_ANGLE = 24.0
"""Vertical opening of the cameras, degrees."""
MARGIN = 1.12
"""How much more than the brain a camera sees from the front."""

SIDES: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "front": ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    "back": ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    "left": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "right": ((-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "top": ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "bottom": ((0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
}
"""Sides of the animal: where the camera is, and what is up. From the front its left is at the right."""

ABOVE, FARTHER = (0.25, 0.75, 0.65), 1.15
"""Towards the viewer's right, dorsal, anterior: where a brain is seen from obliquely, and how far off
compared to the front."""


@dataclass(frozen=True, eq=False)
class ViewSpace:
    """A brain's own coordinates: the animal's axes, from its middle, in shares of its diagonal."""

    center: Floats  # (3,)
    diagonal: float
    axes: Floats  # (3, 3), rows: towards the viewer's right, dorsal, anterior
    size: Floats  # (3,), extent along the axes, in diagonals

    @classmethod
    def of(cls, surface: SurfaceMesh, frame: BrainFrame) -> ViewSpace:
        """Return the space of a prepared brain."""
        axes = np.stack([np.cross(frame.dorsal, frame.anterior), frame.dorsal, frame.anterior])
        along = surface.vertices @ axes.T
        low, high = along.min(axis=0), along.max(axis=0)
        middle = (low + high) / 2 @ axes
        return cls(middle, surface.diagonal, axes, (high - low) / surface.diagonal)

    def inwards(self, point: Floats) -> Floats:
        """Return file coordinates in this space."""
        return np.asarray(self.axes @ (point - self.center) / self.diagonal)

    def outwards(self, point: Floats) -> Floats:
        """Return coordinates of this space as file coordinates."""
        return np.asarray(self.center + self.diagonal * (point @ self.axes))


@dataclass(frozen=True)
class Pose:
    """Where a camera is and looks, in the space of a brain."""

    position: tuple[float, ...]
    focal_point: tuple[float, ...]
    up: tuple[float, ...]

    @classmethod
    def from_front(cls, space: ViewSpace, aspect: float) -> Pose:
        """Return the pose that sees the whole brain from the front, dorsal up."""
        return cls.from_side(space, aspect, "front")

    @classmethod
    def from_side(cls, space: ViewSpace, aspect: float, side: str) -> Pose:
        """Return the pose that sees the whole brain from one of `SIDES`."""
        direction, up = np.array(SIDES[side][0]), np.array(SIDES[side][1])
        depth, height = np.abs(direction) @ space.size, np.abs(up) @ space.size
        width = np.abs(np.cross(direction, up)) @ space.size
        half = max(height, width / max(aspect, 0.1)) / 2 * MARGIN
        distance = half / np.tan(np.deg2rad(VIEW_ANGLE) / 2) + depth / 2
        position = tuple((float(distance) * direction).tolist())
        return cls(position, (0.0, 0.0, 0.0), SIDES[side][1])

    def turned_as(self, other: Pose) -> Pose:
        """Return this pose with the direction of another one, from where it is looking at."""
        focal = np.array(self.focal_point)
        distance = np.linalg.norm(np.array(self.position) - focal)
        away = np.array(other.position) - np.array(other.focal_point)
        position = focal + distance * away / np.linalg.norm(away)
        return Pose(tuple(position.tolist()), self.focal_point, other.up)

    @classmethod
    def from_above(cls, space: ViewSpace, aspect: float) -> Pose:
        """Return the pose that sees the whole brain obliquely from above and before it."""
        near = cls.from_front(space, aspect)
        distance = float(np.linalg.norm(near.position)) * FARTHER
        direction = np.array(ABOVE) / np.linalg.norm(ABOVE)
        return cls(tuple((distance * direction).tolist()), near.focal_point, near.up)


class CameraLink(QObject):
    """Keeps the cameras of several views at the same place relative to their brains."""

    def __init__(self, views: Sequence[SurfaceView], parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._views = views
        self.is_on = True
        self.is_rotation_only = False
        for view in views:
            view.canvas.camera_moved.connect(lambda view=view: self._on_moved(view))

    def set_on(self, on: bool) -> None:
        """Switch the link; switched on, the other views follow the first."""
        self.is_on = on
        if on:
            self._on_moved(self._views[0])

    def set_rotation_only(self, on: bool) -> None:
        """Link only the directions, so that each brain can be enlarged by itself."""
        self.is_rotation_only = on

    def _on_moved(self, moved: SurfaceView) -> None:
        pose = moved.pose()
        if self.is_on and pose is not None:
            for view in self._views:
                own = view.pose()
                if view is not moved and own is not None:
                    view.set_pose(own.turned_as(pose) if self.is_rotation_only else pose)
