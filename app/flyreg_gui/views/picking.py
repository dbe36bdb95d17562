"""What lies under the mouse: the nearest visible landmark, or a place of the surface.

Places are found by the line of sight on the very faces that are drawn, in the widget's own
coordinates: neither the screen's pixels per point nor what else is drawn can mislead it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF

from flyreg_core.mesh import SurfaceMesh
from flyreg_core.same_place import SurfacePlace
from flyreg_core.sight import look
from flyreg_gui.views.canvas import Canvas

Floats = NDArray[np.float64]

MARKER_REACH = 12.0
"""How far from a landmark a click still means it, in pixels."""


def way_along(
    canvas: Canvas, position: QPointF, point: Floats, line: Floats, flattest: float
) -> float | None:
    """Return how far along a line through a point it passes a position in the widget nearest.

    None where the squared sine between the line, a unit vector, and the line of sight is less than
    `flattest`: it is seen end on.
    """
    origin, sight = canvas.line_of_sight(position)
    along, arm = float(line @ sight), origin - point
    squared_sine = 1 - along**2
    if squared_sine < flattest:
        return None
    return float((arm @ line - along * (arm @ sight)) / squared_sine)


@dataclass(frozen=True, eq=False)
class ClipPlane:
    """What lies behind the plane, seen along its normal, is drawn; what lies before it is not."""

    origin: Floats  # (3,)
    normal: Floats  # (3,), unit

    def keeps(self, points: Floats) -> NDArray[np.bool_]:
        """Tell which of (n, 3) points are drawn."""
        return np.asarray((points - self.origin) @ self.normal <= 0)


@dataclass(frozen=True, eq=False)
class SurfaceHit:
    """Where the line of sight meets the surface first."""

    place: SurfacePlace
    point: tuple[float, float, float]
    distance: float  # from the camera, along its direction


class PickableSurface:
    """A surface as it is drawn in a canvas: whole, or cut by a plane."""

    def __init__(self, canvas: Canvas, mesh: SurfaceMesh, clip: ClipPlane | None = None) -> None:
        self._canvas, self.mesh, self._clip = canvas, mesh, clip

    def pick(self, position: QPointF) -> SurfaceHit | None:
        """Return the outside of the surface under a position in the widget.

        None beside it, and where a cut opens the view of the inside.
        """
        start, direction = self._canvas.line_of_sight(position)
        nearest, farthest = -np.inf, np.inf
        if self._clip is not None:
            height = float((start - self._clip.origin) @ self._clip.normal)
            rise = float(direction @ self._clip.normal)
            if rise == 0:
                if height > 0:
                    return None
            elif rise < 0:
                nearest = -height / rise
            else:
                farthest = -height / rise
        seen = look(self.mesh, start, direction, nearest, farthest)
        if seen is None or (self._clip is not None and seen.is_front != self._is_turned_out):
            return None
        camera = self._canvas.renderer.GetActiveCamera()
        offset = seen.point - np.array(camera.GetPosition())
        return SurfaceHit(
            SurfacePlace(seen.face, seen.barycentric),
            (float(seen.point[0]), float(seen.point[1]), float(seen.point[2])),
            float(offset @ np.array(camera.GetDirectionOfProjection())),
        )

    def is_whole_at(self, point: Floats) -> bool:
        """Tell whether a (3,) point is not cut away."""
        return self._clip is None or bool(self._clip.keeps(point[None])[0])

    @cached_property
    def _is_turned_out(self) -> bool:
        """Faces of mirrored files are turned inwards."""
        return self.mesh.volume >= 0


def nearest_marker(
    canvas: Canvas,
    position: QPointF,
    points: Floats,
    radii: Floats,
    surface: PickableSurface | None = None,
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
        if not surface.is_whole_at(points[index]):
            continue
        front = depths[index] - radii[index]
        sights = [QPointF(*pixels[index])]
        if away[index] * canvas.micrometres_per_pixel() <= radii[index]:
            sights.append(position)
        if any(is_open(surface, sight, front) for sight in sights):
            return int(index)
    return None


def is_open(surface: PickableSurface, sight: QPointF, depth: float) -> bool:
    """Tell whether no surface lies before a depth on a line of sight."""
    hit = surface.pick(sight)
    return hit is None or hit.distance >= depth
