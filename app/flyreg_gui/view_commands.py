"""What the user does with the views: where cameras look from, what is shown, how it is compared."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QObject, QTimer

from flyreg_gui.selection import Selection
from flyreg_gui.views.camera import Pose
from flyreg_gui.views.flat_view import FlatView
from flyreg_gui.views.surface_view import SurfaceView
from flyreg_gui.views.view_area import ViewArea

BLINK_MS = 600
"""How long the registered source is seen, and then the target."""
LARGER = 1.25
SMALLEST_MARKER, LARGEST_MARKER = 0.2, 5.0


class ViewCommands(QObject):
    """Commands on the views that need more than one of them."""

    def __init__(self, area: ViewArea, selection: Selection) -> None:
        super().__init__(area)
        self._area, self._selection = area, selection
        self._blink = QTimer(self)
        self._blink.setInterval(BLINK_MS)
        self._blink.timeout.connect(self._on_blink)
        self._shows_target = False

    # Cameras

    def look_from(self, side: str) -> None:
        """See the brains from a side of the animal."""
        for view in self._area.surface_views:
            view.look_from(side)

    def focus(self) -> None:
        """Turn around what is under the cursor from now on; in a flat half, centre it."""
        view = self._under_mouse()
        point = self._area.pointer.point_of(view)
        if view is not None and point is not None:
            view.focus(point)

    def fly_to_selected(self) -> None:
        """Turn the brains so that the landmark selected last faces the user."""
        if self._selection.ids:
            self._area.look_at(self._selection.ids[-1])

    def give_view(self) -> None:
        """Let the other brains be seen as the one under the cursor."""
        pose = self._brain_under_mouse().pose()
        if pose is not None:
            self._set_poses(pose)

    def take_view(self) -> None:
        """Let the brain under the cursor be seen as the source, and the source as the target."""
        here, area = self._brain_under_mouse(), self._area
        pose = (area.target if here is area.source else area.source).pose()
        if pose is not None:
            here.set_pose(pose)

    def _set_poses(self, pose: Pose) -> None:
        for view in self._area.surface_views:
            view.set_pose(pose)

    def _under_mouse(self) -> SurfaceView | FlatView | None:
        return next((view for view in self._area.views if view.canvas.underMouse()), None)

    def _brain_under_mouse(self) -> SurfaceView:
        view = self._under_mouse()
        return view if isinstance(view, SurfaceView) else self._area.source

    # Landmarks

    def resize_markers(self, direction: int) -> None:
        """Draw landmarks larger (1) or smaller (-1), each time by a quarter."""
        size = self._area.marker_scale * LARGER**direction
        self._area.set_marker_scale(float(np.clip(size, SMALLEST_MARKER, LARGEST_MARKER)))

    # Comparison

    def set_blinking(self, on: bool) -> None:
        """Show the registered source and the target in turn, or mixed as before."""
        if on:
            self._blink.start()
            self._on_blink()
        else:
            self._blink.stop()
            self._area.show_instead(None)

    def _on_blink(self) -> None:
        self._shows_target = not self._shows_target
        self._area.show_instead(1.0 if self._shows_target else 0.0)
