"""What is drawn: layers are updated in place; only new topology makes new VTK objects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from pyvista import BasePlotter
from vtkmodules.vtkCommonDataModel import vtkPlane
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkCoordinate,
    vtkGlyph3DMapper,
    vtkPolyDataMapper,
    vtkTextActor,
)

from flyreg_core.mesh import Integers
from flyreg_gui.theme import Color, unit
from flyreg_gui.views.canvas import Canvas

Floats = NDArray[np.float64]
Colors = NDArray[np.uint8]

MOST_RESOLUTION, LEAST_RESOLUTION, LIGHT_RESOLUTION = 14, 6, 4
MOST_TRIANGLES, LIGHT_TRIANGLES = 50_000, 20_000
"""Balls are made of so few triangles that all together have no more, if that is enough."""
CUBE = 1.7
"""Edge of a cube that marks as much as a ball of radius 1."""
IN_FRONT = -66_000.0
"""Offset that shifts any depth to the nearest one; VTK divides it by 65,000."""
RIM = 20
"""Brightness of the rim of a dot."""
LABEL_OFFSET = (9, 5)
"""Where a label stands relative to its point, in pixels."""


class SheetLayer:
    """Translucent sheets of one colour with their outlines."""

    def __init__(self, plotter: BasePlotter, opacity: float, width: float) -> None:
        self._fill, self._outline = vtkActor(), LineLayer(plotter, (0, 0, 0), width)
        self._mapper = vtkPolyDataMapper()
        self._fill.SetMapper(self._mapper)
        self._fill.PickableOff()
        self._fill.GetProperty().SetLighting(False)
        self._fill.GetProperty().SetOpacity(opacity)
        self._fill.VisibilityOff()
        plotter.renderer.AddActor(self._fill)

    def set_color(self, color: Color) -> None:
        """Draw in another colour."""
        self._fill.GetProperty().SetColor(*unit(color))
        self._outline.set_color(color)

    def set_width(self, width: float) -> None:
        """Draw the outlines in another width, in pixels."""
        self._outline.set_width(width)

    def show(self, sheets: Sequence[Floats]) -> None:
        """Draw sheets: each a (2, k, 3) array, the two long edges of a strip."""
        self._fill.SetVisibility(len(sheets) > 0)
        points, quads, edges = [np.zeros((0, 3))], [], []
        start = 0
        for sheet in sheets:
            k = sheet.shape[1]
            near, far = start + np.arange(k), start + k + np.arange(k)
            quads.append(
                np.column_stack([np.full(k - 1, 4), near[:-1], near[1:], far[1:], far[:-1]])
            )
            ring = np.concatenate([near, far[::-1]])
            edges.append(np.column_stack([ring, np.roll(ring, -1)]))
            points.append(sheet.reshape(-1, 3))
            start += 2 * k
        corners = np.concatenate(points)
        if sheets:
            faces = np.concatenate(quads).reshape(-1)
            self._mapper.SetInputData(pv.PolyData(corners.astype(np.float32), faces))
        segments = np.concatenate(edges) if edges else np.zeros((0, 2), dtype=np.int64)
        self._outline.show(corners, segments)


class MarkerLayer:
    """Balls at points, or cubes, each with its own colour and size."""

    def __init__(self, canvas: Canvas, *, flat: bool = False, are_cubes: bool = False) -> None:
        self._canvas = canvas
        self._resolution = 0  # of the balls
        self._polydata = pv.PolyData()
        self._mapper = vtkGlyph3DMapper()
        self._mapper.SetInputData(self._polydata)
        self._mapper.SetScaleArray("radius")
        self._mapper.SetScaleModeToScaleByMagnitude()
        self._mapper.SetScalarModeToUsePointFieldData()
        self._mapper.SelectColorArray("color")
        self._mapper.SetColorModeToDirectScalars()
        self.actor = vtkActor()
        self.actor.SetMapper(self._mapper)
        self.actor.PickableOff()
        self.actor.GetProperty().SetLighting(not flat)
        self.actor.GetProperty().SetAmbient(0.35)
        self.actor.VisibilityOff()
        canvas.renderer.AddActor(self.actor)
        if flat or are_cubes:
            self._mapper.SetSourceData(_cube() if are_cubes else _disc())
        else:
            canvas.before_drawing(self._shape)

    def _shape(self) -> None:
        """Make balls of fewer triangles where there are many, and fewer still while a hand moves."""
        is_light, count = self._canvas.is_light, max(self._polydata.n_points, 1)
        least = LIGHT_RESOLUTION if is_light else LEAST_RESOLUTION
        most = LIGHT_TRIANGLES if is_light else MOST_TRIANGLES
        resolution = min(max(int(np.sqrt(most / (2 * count))), least), MOST_RESOLUTION)
        if resolution != self._resolution:
            self._resolution = resolution
            self._mapper.SetSourceData(_ball(resolution))

    def set_clip(self, plane: vtkPlane | None) -> None:
        """Draw only what lies where the plane's normal points to, or all."""
        clip_by(self._mapper, plane)

    def bring_to_front(self) -> None:
        """Draw the balls over everything that is nearer."""
        draw_in_front(self._mapper)

    def show(self, points: Floats, radii: Floats, colors: Colors) -> None:
        """Draw balls at (n, 3) points."""
        self.actor.SetVisibility(len(points) > 0)
        if not len(points):
            return
        if self._polydata.n_points == len(points):
            put(self._polydata.points, points)
        else:
            self._polydata = pv.PolyData(points.astype(np.float32))
            self._mapper.SetInputData(self._polydata)
        self._polydata.point_data["radius"] = radii.astype(np.float32)
        self._polydata.point_data["color"] = np.array(colors)
        self._polydata.Modified()


def _ball(resolution: int) -> pv.PolyData:
    return pv.Sphere(radius=1.0, theta_resolution=resolution, phi_resolution=resolution)


def _disc() -> pv.PolyData:
    """Return what is seen of a ball from above."""
    disc: pv.PolyData = pv.Disc(inner=0.0, outer=1.0, r_res=1, c_res=2 * MOST_RESOLUTION)
    return disc


def _cube() -> pv.PolyData:
    return pv.Cube(x_length=CUBE, y_length=CUBE, z_length=CUBE)


class DotLayer:
    """Dots of a fixed size on the screen, over everything that is nearer."""

    def __init__(self, plotter: BasePlotter, size: float, halo: float) -> None:
        self._sizes = (size + halo, size)
        self._mappers = [vtkPolyDataMapper(), vtkPolyDataMapper()]  # dark rim, dot
        self._actors = [vtkActor(), vtkActor()]
        for actor, mapper in zip(self._actors, self._mappers, strict=True):
            mapper.SetScalarModeToUsePointFieldData()
            mapper.SelectColorArray("color")
            mapper.SetColorModeToDirectScalars()
            draw_in_front(mapper)
            actor.SetMapper(mapper)
            actor.PickableOff()
            actor.GetProperty().SetLighting(False)
            actor.GetProperty().SetRenderPointsAsSpheres(True)
            actor.VisibilityOff()
            plotter.renderer.AddActor(actor)

    def set_scale(self, scale: float) -> None:
        """Take the device's pixels per point."""
        for actor, size in zip(self._actors, self._sizes, strict=True):
            actor.GetProperty().SetPointSize(scale * size)

    def show(self, points: Floats, colors: Colors) -> None:
        """Draw dots at (n, 3) points."""
        dark = np.full((len(points), 3), RIM, dtype=np.uint8)
        for actor, mapper, color in zip(
            self._actors, self._mappers, (dark, np.array(colors)), strict=True
        ):
            actor.SetVisibility(len(points) > 0)
            if len(points):
                data = pv.PolyData(points.astype(np.float32))
                data.point_data["color"] = color
                mapper.SetInputData(data)


class LineLayer:
    """Line segments of one colour."""

    def __init__(self, plotter: BasePlotter, color: Color, width: float = 1.0) -> None:
        self._polydata = pv.PolyData()
        self._segments: Integers | None = None
        self._mapper = vtkPolyDataMapper()
        self._mapper.ScalarVisibilityOff()
        self.actor = vtkActor()
        self.actor.SetMapper(self._mapper)
        self.actor.PickableOff()
        self.actor.GetProperty().SetLighting(False)
        self.actor.GetProperty().SetLineWidth(width)
        self.actor.VisibilityOff()
        self.set_color(color)
        plotter.renderer.AddActor(self.actor)

    def set_color(self, color: Color, opacity: float = 1.0) -> None:
        """Draw in another colour."""
        self.actor.GetProperty().SetColor(*unit(color))
        self.actor.GetProperty().SetOpacity(opacity)

    def bring_to_front(self) -> None:
        """Draw the lines over everything that is nearer."""
        draw_in_front(self._mapper)

    def set_width(self, width: float) -> None:
        """Draw lines of another width, in pixels."""
        self.actor.GetProperty().SetLineWidth(width)

    def show(self, points: Floats, segments: Integers) -> None:
        """Draw a line between the two points of each row of `segments` (m, 2)."""
        self.actor.SetVisibility(len(segments) > 0)
        if not len(segments):
            return
        if segments is self._segments and self._polydata.n_points == len(points):
            put(self._polydata.points, points)
        else:
            lines = np.column_stack([np.full(len(segments), 2), segments]).astype(np.int64)
            self._polydata = pv.PolyData(points.astype(np.float32), lines=lines.reshape(-1))
            self._mapper.SetInputData(self._polydata)
            self._segments = segments
        self._polydata.Modified()

    def show_pairs(self, starts: Floats, ends: Floats) -> None:
        """Draw a line from each start to the end in the same row."""
        index = np.arange(2 * len(starts), dtype=np.int64).reshape(-1, 2)
        points = np.stack([starts, ends], axis=1).reshape(-1, 3)
        self.show(points, index)


class LabelLayer:
    """A few short texts, each beside its point and in front of everything."""

    def __init__(self, canvas: Canvas, size: int = 12, *, centered: bool = False) -> None:
        self._canvas, self._size, self._centered = canvas, size, centered
        self._actors: list[vtkTextActor] = []
        self._scale = 1.0
        self._color: Color = (0, 0, 0)
        self._background: Color = (255, 255, 255)
        canvas.before_drawing(self._keep_inside)

    def _keep_inside(self) -> None:
        """Write to the left of their points what would be cut off at the right border."""
        if self._centered:
            return
        renderer, size = self._canvas.renderer, [0.0, 0.0]
        right, up = LABEL_OFFSET
        for actor in self._actors:
            if not actor.GetVisibility():
                continue
            place = actor.GetPositionCoordinate()
            x = place.GetReferenceCoordinate().GetComputedDoubleDisplayValue(renderer)[0]
            actor.GetSize(renderer, size)
            room = size[0] + self._scale * right
            is_turned = x + room > renderer.GetSize()[0] and x > room
            if is_turned:
                actor.GetTextProperty().SetJustificationToRight()
            else:
                actor.GetTextProperty().SetJustificationToLeft()
            side = -right if is_turned else right
            place.SetValue(self._scale * side, self._scale * up, 0.0)

    def set_style(self, color: Color, background: Color, scale: float) -> None:
        """Take the colours of a theme and the device's pixels per point."""
        self._color, self._background, self._scale = color, background, scale
        for actor in self._actors:
            self._style(actor)

    def show(self, points: Floats, texts: Sequence[str]) -> None:
        """Write one text beside each of the (n, 3) points."""
        while len(self._actors) < len(texts):
            actor = vtkTextActor()
            actor.PickableOff()
            place = vtkCoordinate()
            place.SetCoordinateSystemToWorld()
            actor.GetPositionCoordinate().SetCoordinateSystemToViewport()
            actor.GetPositionCoordinate().SetReferenceCoordinate(place)
            self._style(actor)
            self._canvas.renderer.AddActor(actor)
            self._actors.append(actor)
        for i, actor in enumerate(self._actors):
            actor.SetVisibility(i < len(texts))
            if i < len(texts):
                actor.SetInput(texts[i])
                actor.GetPositionCoordinate().GetReferenceCoordinate().SetValue(*points[i])

    def _style(self, actor: vtkTextActor) -> None:
        style = actor.GetTextProperty()
        style.SetFontSize(self._size)  # VTK knows the device's pixels per point
        style.SetColor(*unit(self._color))
        if self._centered:
            style.SetJustificationToCentered()
            style.SetVerticalJustificationToCentered()
        else:
            style.SetVerticalJustificationToBottom()
            style.SetBackgroundColor(*unit(self._background))
            style.SetBackgroundOpacity(0.7)


def clip_by(mapper: Any, plane: vtkPlane | None) -> None:
    """Have a mapper draw only one side of a plane, or all."""
    mapper.RemoveAllClippingPlanes()
    if plane is not None:
        mapper.AddClippingPlane(plane)


def draw_in_front(mapper: Any) -> None:
    """Have a mapper draw as if everything lay at the eye, so that nothing hides it."""
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0.0, IN_FRONT)
    mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(0.0, IN_FRONT)
    mapper.SetRelativeCoincidentTopologyPointOffsetParameter(IN_FRONT)


def put(array: Any, values: Floats | NDArray[np.float32] | Colors) -> None:
    """Write into an array of VTK in place, and have VTK notice."""
    array[:] = values
