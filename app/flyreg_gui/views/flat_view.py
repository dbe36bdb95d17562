"""One half of the brain laid flat: the source's half as the spline moved it, over the target's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF

from flyreg_core.correspondence import PlacedLandmark
from flyreg_core.landmarks import HalfName
from flyreg_core.lift import WarpedHalf
from flyreg_core.mesh import Floats, Integers
from flyreg_core.results import Results
from flyreg_core.topology import boundary_loops
from flyreg_gui.theme import SOURCE, Theme
from flyreg_gui.views.canvas import FlatCanvas
from flyreg_gui.views.layers import LabelLayer, LineLayer, MarkerLayer
from flyreg_gui.views.markers import MarkerStyle
from flyreg_gui.views.picking import nearest_marker
from flyreg_gui.views.surface_layer import SurfaceLayer

WIDTH, HEIGHT = 3.0, 2.0
GRID_STEP = 0.2
MARKER_RADIUS = 0.026
MARGIN = 1.14
TARGET_Z, SOURCE_Z, GRID_Z, OUTLINE_Z, ARROW_Z, MARKER_Z = 0.0, 0.01, 0.02, 0.03, 0.04, 0.1
CAMERA_Z = 5.0


@dataclass(frozen=True, eq=False)
class GridLines:
    """The lines x = const and y = const of a flat mesh, as points on its edges.

    The points keep their shares of the edges when the vertices move, and so show how the plane
    is bent.
    """

    starts: Integers  # (2 s,) vertices
    ends: Integers  # (2 s,)
    shares: Floats  # (2 s, 1), 0 at the start
    segments: Integers  # (s, 2) into the points

    @classmethod
    def of(cls, plane: Floats, faces: Integers) -> GridLines:
        """Return the lines of a mesh with (k, 2) vertices."""
        parts = []
        for axis, size in enumerate((WIDTH, HEIGHT)):
            place = plane[:, axis]
            is_crossed = np.ptp(np.ceil((place + size / 2) / GRID_STEP)[faces], axis=1) > 0
            for level in np.arange(GRID_STEP - size / 2, size / 2 - 1e-9, GRID_STEP):
                parts.append(_level_line(place - level, faces[is_crossed]))
        starts, ends, shares = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        segments = np.arange(len(starts), dtype=np.int64).reshape(-1, 2)
        return cls(starts, ends, shares[:, None], segments)

    def points(self, plane: Floats) -> Floats:
        """Return the points for other positions of the vertices."""
        return np.asarray((1 - self.shares) * plane[self.starts] + self.shares * plane[self.ends])


def _level_line(height: Floats, faces: Integers) -> tuple[Integers, Integers, Floats]:
    """Return where the zero line of `height` (k,) crosses edges: two points for each face."""
    above = height[faces] > 0
    crossed = faces[above.any(axis=1) & ~above.all(axis=1)]
    edges = np.stack([crossed, np.roll(crossed, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = edges[(height[edges] > 0).sum(axis=1) == 1]
    start, end = height[edges[:, 0]], height[edges[:, 1]]
    return edges[:, 0], edges[:, 1], start / (start - end)


class FlatView:
    """One half: target below, source above, grid, outline, and each landmark's way."""

    def __init__(self, canvas: FlatCanvas, half: HalfName) -> None:
        self.canvas, self.half = canvas, half
        canvas.before_drawing(self._bend)  # before its layers
        self._target = SurfaceLayer(canvas, "target", lit=False)
        self._source = SurfaceLayer(canvas, "source", lit=False)
        self._grid = LineLayer(canvas, SOURCE)
        self._outline = LineLayer(canvas, SOURCE, 1.5)
        self._arrows = LineLayer(canvas, SOURCE, 1.5)
        self._starts = MarkerLayer(canvas, flat=True)
        self._markers = MarkerLayer(canvas, flat=True)
        self._labels = LabelLayer(canvas)
        self._sides = LabelLayer(canvas, 11, centered=True)
        self._drawn: tuple[object, ...] = ()  # the halves and the colours on show
        self._lines: GridLines | None = None
        self._warped: WarpedHalf | None = None  # to be drawn, but not yet
        self._loops: Integers | None = None
        self._ids: tuple[str, ...] = ()
        self._points, self._radii = np.zeros((0, 3)), np.zeros(0)
        self._blend = 0.0
        self.marker_scale = 1.0
        self.named: frozenset[str] = frozenset()
        self._is_home = True
        canvas.renderer.GetActiveCamera().SetParallelProjection(True)
        canvas.camera_moved.connect(self._on_camera_moved)
        canvas.resized.connect(self._on_resized)
        self.go_home()

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        scale = self.canvas.devicePixelRatioF()
        self._labels.set_style(theme.text, theme.background, scale)
        self._sides.set_style(theme.faint, theme.background, scale)
        self._outline.set_color(theme.text)
        self._arrows.set_color(theme.text)
        self._grid.set_color(theme.background if theme.is_dark else (255, 255, 255), 0.55)
        for lines in (self._outline, self._arrows):
            lines.set_width(1.5 * scale)
        self._grid.set_width(scale)
        self.canvas.show_theme(theme)

    def show(self, results: Results, source: NDArray[np.uint8], target: NDArray[np.uint8]) -> None:
        """Draw a registration; `source` and `target` are the colours of the surfaces' vertices."""
        mine, other = results.source.halves[self.half], results.target.halves[self.half]
        warped = results.registration.halves[self.half]
        drawn = (mine, other, source, target)
        self._warped, self._faces = warped, mine.faces
        if not self._drawn or any(a is not b for a, b in zip(drawn, self._drawn, strict=True)):
            self._drawn = drawn
            self._lines = GridLines.of(mine.plane, mine.faces)
            self._source.hide()
            self._target.show(raised(other.plane, TARGET_Z), other.faces, target[other.vertex_of])
            self._colors = source[mine.vertex_of]
            self._bend()
            self._source.set_opacity(1 - self._blend)
            self._show_outline(other.plane, other.faces)
            self._show_sides()
        self.canvas.refresh()

    def _bend(self) -> None:
        """Move the source and its grid to where they are to be drawn."""
        warped, self._warped = self._warped, None
        if warped is not None and self._lines is not None:
            plane = warped.plane
            self._source.show(raised(plane, SOURCE_Z), self._faces, self._colors)
            self._grid.show(raised(self._lines.points(plane), GRID_Z), self._lines.segments)

    def show_landmarks(self, landmarks: tuple[PlacedLandmark, ...], style: MarkerStyle) -> None:
        """Draw the landmarks of this half: small where one starts, large where it belongs."""
        rows = [i for i, landmark in enumerate(landmarks) if self.half in landmark.plane]
        pairs = np.array([landmarks[i].plane[self.half] for i in rows]).reshape(-1, 2, 2)
        starts, ends = raised(pairs[:, 0], MARKER_Z), raised(pairs[:, 1], MARKER_Z)
        self._ids, self._points = tuple(style.ids[i] for i in rows), ends
        self._radii = style.sizes[rows] * MARKER_RADIUS * self.marker_scale
        self._markers.show(ends, self._radii, style.colors[rows])
        self._starts.show(starts, 0.45 * self._radii, style.colors[rows])
        self._arrows.show_pairs(raised(pairs[:, 0], ARROW_Z), raised(pairs[:, 1], ARROW_Z))
        chosen = [row for row, number in enumerate(rows) if style.ids[number] in self.named]
        self._labels.show(ends[chosen], [style.names[rows[i]] for i in chosen])
        self.canvas.refresh()

    def set_blend(self, blend: float) -> None:
        """Show the source at 0, the target at 1, and a mixture between."""
        self._blend = blend
        self._source.set_opacity(1 - blend)
        self.canvas.refresh()

    def clear(self) -> None:
        """Show nothing."""
        self._source.hide()
        self._target.hide()
        self._drawn, self._warped = (), None
        nothing, no_lines = np.zeros((0, 3)), np.zeros((0, 2), dtype=np.int64)
        for lines in (self._grid, self._outline, self._arrows):
            lines.show(nothing, no_lines)
        for markers in (self._starts, self._markers):
            markers.show(nothing, np.zeros(0), np.zeros((0, 3), dtype=np.uint8))
        self._labels.show(nothing, [])
        self._sides.show(nothing, [])
        self._ids, self._points = (), nothing
        self.canvas.refresh()

    def landmark_at(self, position: QPointF) -> str | None:
        """Return the id of the landmark at a position in the widget."""
        index = nearest_marker(self.canvas, position, self._points, self._radii)
        return None if index is None else self._ids[index]

    def plane_at(self, position: QPointF) -> Floats:
        """Return the (2,) place of the rectangle's plane at a position in the widget."""
        start, _ = self.canvas.line_of_sight(position)
        return np.asarray(start[:2])

    def raised_mark(self, place: Floats) -> Floats:
        """Return the (3,) point of the scene where a (2,) place of the rectangle is marked."""
        return np.append(place, MARKER_Z)

    def focus(self, point: Floats) -> None:
        """Bring a (3,) point of the scene to the middle."""
        self.canvas.look_down(point[0], point[1], CAMERA_Z)
        self._is_home = False
        self.canvas.refresh()

    def go_home(self) -> None:
        """See the whole rectangle."""
        camera = self.canvas.renderer.GetActiveCamera()
        aspect = self.canvas.width() / max(self.canvas.height(), 1)
        self.canvas.look_down(0, 0, CAMERA_Z)
        camera.SetViewUp(0, 1, 0)
        camera.SetParallelScale(MARGIN * max(HEIGHT, WIDTH / max(aspect, 0.1)) / 2)
        self._is_home = True
        self.canvas.refresh()

    def _show_outline(self, plane: Floats, faces: Integers) -> None:
        loops = [np.stack([loop, np.roll(loop, -1)], axis=1) for loop in boundary_loops(faces)]
        self._outline.show(raised(plane, OUTLINE_Z), np.concatenate(loops))

    def _show_sides(self) -> None:
        left, right = ("R", "L") if self.half == "anterior" else ("L", "R")
        edge = WIDTH / 2 + 0.09
        places = np.array([[-edge, 0, MARKER_Z], [edge, 0, MARKER_Z]])
        self._sides.show(places, [left, right])

    def _on_camera_moved(self) -> None:
        self._is_home = False

    def _on_resized(self) -> None:
        if self._is_home:
            self.go_home()


def raised(plane: Floats, z: float) -> Floats:
    """Return (n, 2) points of the plane as (n, 3) points at a height."""
    return np.column_stack([plane, np.full(len(plane), z)])
