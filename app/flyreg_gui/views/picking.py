"""What lies under the mouse: the nearest visible landmark, or a point of the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from PySide6.QtCore import QPointF
from vtkmodules.vtkRenderingCore import vtkCellPicker

from flyreg_gui.views.canvas import Canvas

Floats = NDArray[np.float64]

MARKER_REACH = 12.0
"""How far from a landmark a click still means it, in pixels."""


@dataclass(frozen=True)
class SurfaceHit:
    """Where the line of sight meets the surface first."""

    point: tuple[float, float, float]
    distance: float  # from the camera, along its direction


class SurfacePicker:
    """Finds points on one actor of a canvas, and on nothing else that is drawn there."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self._picker = vtkCellPicker()
        self._picker.SetTolerance(0.0)
        self._picker.PickFromListOn()

    def pick(self, position: QPointF, actor: pv.Actor) -> SurfaceHit | None:
        """Return the front of the surface under a position in the widget; None beside it."""
        self._picker.InitializePickList()
        self._picker.AddPickList(actor)
        x, y = self._canvas.to_display(position)
        camera = self._canvas.renderer.GetActiveCamera()
        direction = np.array(camera.GetDirectionOfProjection())
        if not self._picker.Pick(x, y, 0, self._canvas.renderer):
            return None
        point = np.array(self._picker.GetPickPosition())
        offset = point - np.array(camera.GetPosition())
        if not camera.GetParallelProjection():
            direction_here = offset / np.linalg.norm(offset)
        else:
            direction_here = direction
        if self._face_normal() @ direction_here >= 0:
            return None
        return SurfaceHit(tuple(point.tolist()), float(offset @ direction))

    def _face_normal(self) -> Floats:
        corners = self._picker.GetDataSet().GetCell(self._picker.GetCellId()).GetPoints()
        a, b, c = (np.array(corners.GetPoint(i)) for i in range(3))
        return np.asarray(np.cross(b - a, c - a))


def nearest_marker(
    canvas: Canvas,
    position: QPointF,
    points: Floats,
    radii: Floats,
    surface: tuple[SurfacePicker, pv.Actor] | None = None,
) -> int | None:
    """Return the number of the visible marker nearest to a position, if one is near enough.

    Parameters
    ----------
    points, radii : (n, 3) and (n,) float
        The markers, balls in the coordinates of the scene.
    surface : optional
        What can hide markers. One is hidden where the surface lies before its ball.
    """
    if not len(points):
        return None
    pixels, depths = canvas.to_pixels(points)
    away = np.hypot(pixels[:, 0] - position.x(), pixels[:, 1] - position.y())
    for index in np.argsort(away):
        if away[index] > MARKER_REACH:
            return None
        if surface is None:
            return int(index)
        front = depths[index] - radii[index]
        sights = [QPointF(*pixels[index])]
        if away[index] * canvas.micrometres_per_pixel() <= radii[index]:
            sights.append(position)
        if any(_is_open(surface, sight, front) for sight in sights):
            return int(index)
    return None


def _is_open(surface: tuple[SurfacePicker, pv.Actor], sight: QPointF, depth: float) -> bool:
    """Tell whether no surface lies before a depth on a line of sight."""
    picker, actor = surface
    hit = picker.pick(sight, actor)
    return hit is None or hit.distance >= depth
