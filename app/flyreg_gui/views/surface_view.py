"""A brain in space with its landmarks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF
from vtkmodules.vtkCommonDataModel import vtkPlane

from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_gui.panels.cut_bar import Cut
from flyreg_gui.theme import Theme
from flyreg_gui.views.camera import VIEW_ANGLE, Pose, ViewSpace
from flyreg_gui.views.canvas import Canvas
from flyreg_gui.views.layers import LabelLayer, MarkerLayer
from flyreg_gui.views.markers import MarkerStyle
from flyreg_gui.views.picking import ClipPlane, PickableSurface, SurfaceHit, nearest_marker
from flyreg_gui.views.surface_layer import SurfaceLayer

MARKER_RADIUS = 0.011
"""Radius of a landmark of weight 1, as a share of the brain's diagonal."""
OVERLAY_STEPS = 4.0
NEUROPIL_OPACITY = 0.65

NO_POINTS = np.zeros((0, 3))


class SurfaceView:
    """One surface, perhaps one over it, landmarks, and a point that waits for its partner."""

    def __init__(self, canvas: Canvas) -> None:
        self.canvas = canvas
        self.surface = SurfaceLayer(canvas, "surface")
        self.overlay = SurfaceLayer(canvas, "overlay")
        self.neuropils = SurfaceLayer(canvas, "neuropils")
        self._neuropil_mesh: SurfaceMesh | None = None
        self._markers, self._waiting = MarkerLayer(canvas), MarkerLayer(canvas)
        self._half_made = MarkerLayer(canvas, are_cubes=True)
        self._half_made_ids: tuple[str, ...] = ()
        self._half_made_points = NO_POINTS
        self._half_made_drawn: tuple[object, ...] | None = None
        self._labels = LabelLayer(canvas)
        self._half_made_labels = LabelLayer(canvas)
        self._mesh: SurfaceMesh | None = None
        self._clip: ClipPlane | None = None
        self._points, self._radii = NO_POINTS, np.zeros(0)
        self._ids: tuple[str, ...] = ()
        self._space: ViewSpace | None = None
        self._theme: Theme | None = None
        self._style: MarkerStyle | None = None
        self._is_home = True
        self._overlay_opacity = 0.0
        self.marker_scale = 1.0
        self.named: frozenset[str] = frozenset()  # ids of landmarks whose names are written
        self._written = self.named
        self._cut: Cut | None = None
        self._plane = vtkPlane()
        canvas.renderer.GetActiveCamera().SetViewAngle(VIEW_ANGLE)
        canvas.camera_moved.connect(self._on_camera_moved)
        canvas.resized.connect(self._on_resized)

    # What is on show

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        self._theme = theme
        scale = self.canvas.devicePixelRatioF()
        for labels in (self._labels, self._half_made_labels):
            labels.set_style(theme.text, theme.background, scale)
        self.canvas.show_theme(theme)

    def show_surface(self, mesh: SurfaceMesh, colors: NDArray[np.uint8], space: ViewSpace) -> None:
        """Draw the brain; the camera moves only to a brain that was not on show before."""
        self._mesh = mesh
        changed = self.surface.show(mesh.vertices, mesh.faces, colors)
        if space is not self._space:
            was_home = self._is_home or self._space is None
            pose = self.pose()
            self._space = space
            if was_home or pose is None:
                self.go_home()
            else:
                self.set_pose(pose)
            self.set_cut(self._cut)
        if changed:
            self.canvas.refresh()

    def set_cut(self, cut: Cut | None) -> None:
        """Take away what lies on one side of a plane across the brain, or show it whole."""
        self._cut, space = cut, self._space
        self._clip = None if cut is None or space is None else _plane_of(cut, space)
        if self._clip is not None:
            self._plane.SetOrigin(*self._clip.origin)
            self._plane.SetNormal(*-self._clip.normal)
        plane = None if self._clip is None else self._plane
        for layer in (self.surface, self.overlay, self.neuropils, self._markers, self._half_made):
            layer.set_clip(plane)
        self.canvas.refresh()

    def show_overlay(self, mesh: SurfaceMesh, colors: NDArray[np.uint8]) -> None:
        """Draw a second brain over the first, as far as the opacity lets it."""
        if self.overlay.show(mesh.vertices, mesh.faces, colors):
            self.overlay.bring_forward(OVERLAY_STEPS)
            self.overlay.set_opacity(self._overlay_opacity)

    def set_overlay_opacity(self, opacity: float) -> None:
        """Let the second brain cover the first more or less."""
        self._overlay_opacity = opacity
        self.overlay.set_opacity(opacity)
        self.canvas.refresh()

    def show_neuropils(self, mesh: SurfaceMesh, colors: NDArray[np.uint8]) -> None:
        """Draw surfaces within the brain, as if the brain were of glass."""
        self._neuropil_mesh = mesh
        if self.neuropils.show(mesh.vertices, mesh.faces, colors):
            self.neuropils.let_shine_through()
            self.neuropils.set_opacity(NEUROPIL_OPACITY)
            self.canvas.refresh()

    def hide_neuropils(self) -> None:
        """Draw no surfaces within the brain."""
        if self._neuropil_mesh is not None:
            self._neuropil_mesh = None
            self.neuropils.hide()
            self.canvas.refresh()

    def show_landmarks(self, points: Floats, style: MarkerStyle) -> None:
        """Draw landmarks at (n, 3) points."""
        radii = style.sizes * self._unit_radius()
        known = self._style is not None and self._style.looks_like(style)
        known = known and self._written == self.named
        if known and np.array_equal(points, self._points) and np.array_equal(radii, self._radii):
            return
        self._style, self._written = style, self.named
        self._ids, self._points = style.ids, points
        self._radii = radii
        self._markers.show(points, self._radii, style.colors)
        chosen = [row for row, name in enumerate(style.ids) if name in self.named]
        self._labels.show(points[chosen], [style.names[i] for i in chosen])
        self.canvas.refresh()

    def show_half_made(self, points: Floats, ids: tuple[str, ...], names: Sequence[str]) -> None:
        """Draw (n, 3) ends of landmarks whose other ends are still to be placed, as cubes."""
        drawn = (ids, tuple(names), points.tolist(), self._theme)
        if drawn == self._half_made_drawn:
            return
        self._half_made_drawn = drawn
        self._half_made_points, self._half_made_ids = points, ids
        color = self._theme.bad if self._theme else (180, 50, 20)
        colors = np.tile(np.array(color, dtype=np.uint8), (len(points), 1))
        self._half_made.show(points, self._half_made_radii(), colors)
        self._half_made_labels.show(points, [f"{name} …" for name in names])
        self.canvas.refresh()

    def _half_made_radii(self) -> Floats:
        return np.full(len(self._half_made_ids), 1.2 * self._unit_radius())

    def show_waiting_point(self, point: tuple[float, float, float] | None) -> None:
        """Draw a point that is half of a landmark pair, or none."""
        points = NO_POINTS if point is None else np.array([point])
        color = self._theme.good if self._theme else (0, 120, 85)
        colors = np.tile(np.array(color, dtype=np.uint8), (len(points), 1))
        self._waiting.show(points, np.full(len(points), 1.4 * self._unit_radius()), colors)
        self.canvas.refresh()

    def clear(self) -> None:
        """Show nothing."""
        self.surface.hide()
        self.overlay.hide()
        self.hide_neuropils()
        self._mesh = None
        self._space = None
        self._is_home = True
        self.clear_landmarks()

    def clear_landmarks(self) -> None:
        """Show the brain without landmarks."""
        for markers in (self._markers, self._waiting, self._half_made):
            markers.show(NO_POINTS, np.zeros(0), np.zeros((0, 3), dtype=np.uint8))
        self._labels.show(NO_POINTS, [])
        self._half_made_labels.show(NO_POINTS, [])
        self._half_made_ids, self._half_made_points = (), NO_POINTS
        self._half_made_drawn = None
        self._ids, self._points, self._style = (), NO_POINTS, None
        self.canvas.refresh()

    @property
    def cut(self) -> Cut | None:
        """The cut through the brain, if there is one."""
        return self._cut

    @property
    def space(self) -> ViewSpace | None:
        """The brain's own coordinates, if one is shown."""
        return self._space

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of the box around the brain, micrometres; 0 without one."""
        return self._space.diagonal if self._space else 0.0

    def _unit_radius(self) -> float:
        size = MARKER_RADIUS * self.marker_scale
        return size * self._space.diagonal if self._space else 1.0

    # What is under the mouse

    def landmark_at(self, position: QPointF) -> str | None:
        """Return the id of the visible landmark at a position in the widget."""
        points = np.concatenate([self._points, self._half_made_points])
        radii = np.concatenate([self._radii, self._half_made_radii()])
        index = nearest_marker(self.canvas, position, points, radii, self.pickable_surface)
        return None if index is None else (*self._ids, *self._half_made_ids)[index]

    def point_at(self, position: QPointF) -> tuple[float, float, float] | None:
        """Return the point of the surface's front at a position in the widget."""
        hit = self.hit_at(position)
        return None if hit is None else hit.point

    def hit_at(self, position: QPointF) -> SurfaceHit | None:
        """Return the place of the surface's front at a position in the widget."""
        surface = self.pickable_surface
        return None if surface is None else surface.pick(position)

    def neuropil_at(self, position: QPointF) -> SurfaceHit | None:
        """Return the place of the surfaces within the brain that is seen at a position."""
        if self._neuropil_mesh is None:
            return None
        return PickableSurface(self.canvas, self._neuropil_mesh, self._clip).pick(position)

    @property
    def pickable_surface(self) -> PickableSurface | None:
        """The surface as it is drawn, if one is."""
        mesh = self._mesh
        return None if mesh is None else PickableSurface(self.canvas, mesh, self._clip)

    # The camera

    def go_home(self) -> None:
        """See the whole brain from the front."""
        if self._space is not None:
            aspect = self.canvas.width() / max(self.canvas.height(), 1)
            self.set_pose(Pose.from_front(self._space, aspect))
        self._is_home = True

    def look_from(self, side: str) -> None:
        """See the whole brain from a side of the animal."""
        if self._space is not None:
            aspect = self.canvas.width() / max(self.canvas.height(), 1)
            self.set_pose(Pose.from_side(self._space, aspect, side))

    def focus(self, point: Floats) -> None:
        """Bring a (3,) point to the middle, from the direction and distance of now; turn around it."""
        camera = self.canvas.renderer.GetActiveCamera()
        shift = point - np.array(camera.GetFocalPoint())
        camera.SetFocalPoint(*point)
        camera.SetPosition(*(np.array(camera.GetPosition()) + shift))
        self._is_home = False
        self.canvas.refresh()
        self.canvas.camera_moved.emit()

    @property
    def is_home(self) -> bool:
        """Tell whether nobody has moved the camera since it saw the whole brain from the front."""
        return self._is_home

    def pose(self) -> Pose | None:
        """Return where the camera is, relative to the brain."""
        space, camera = self._space, self.canvas.renderer.GetActiveCamera()
        if space is None:
            return None
        return Pose(
            tuple(space.inwards(np.array(camera.GetPosition())).tolist()),
            tuple(space.inwards(np.array(camera.GetFocalPoint())).tolist()),
            tuple((space.axes @ np.array(camera.GetViewUp())).tolist()),
        )

    def set_pose(self, pose: Pose) -> None:
        """Put the camera where another view's is, relative to the brain."""
        if self._space is None:
            return
        camera = self.canvas.renderer.GetActiveCamera()
        camera.SetPosition(*self._space.outwards(np.array(pose.position)))
        camera.SetFocalPoint(*self._space.outwards(np.array(pose.focal_point)))
        camera.SetViewUp(*(np.array(pose.up) @ self._space.axes))
        self._is_home = False
        self.canvas.refresh()

    def look_at(self, identifier: str) -> None:
        """Turn the camera to a landmark, from the distance it has."""
        if identifier in self._ids and self._space is not None:
            camera = self.canvas.renderer.GetActiveCamera()
            point = self._points[self._ids.index(identifier)]
            outwards = point - self._space.center
            outwards /= max(float(np.linalg.norm(outwards)), 1e-9)
            camera.SetFocalPoint(*point)
            camera.SetPosition(*(point + outwards * camera.GetDistance()))
            camera.OrthogonalizeViewUp()
            self.canvas.refresh()
            self.canvas.camera_moved.emit()

    def _on_camera_moved(self) -> None:
        self._is_home = False

    def _on_resized(self) -> None:
        if self._is_home:
            self.go_home()


def _plane_of(cut: Cut, space: ViewSpace) -> ClipPlane:
    """Return a cut in the coordinates of a brain."""
    along = space.axes[cut.axis]
    reach = space.diagonal * space.size[cut.axis] * (cut.share - 0.5)
    return ClipPlane(space.center + reach * along, -along if cut.is_turned else along)
