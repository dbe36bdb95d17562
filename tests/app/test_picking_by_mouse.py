"""Clicks of a real mouse make landmarks on the very faces that are drawn under it."""

from __future__ import annotations

import numpy as np
import pytest
from flyreg_gui.views.surface_view import SurfaceView
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtWidgets import QApplication

from tests.app.hands import LEFT, press
from tests.app.picks import DrawnFaces

pytestmark = pytest.mark.window
CLICKS = 15
EDGE = 1e-6
"""How far outside a face, as a share of it, rounding may put a point."""


def inside(point, corners):
    """Whether a point lies on a triangle, by its areas: another route than the picker's."""
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    areas = [
        np.cross(corners[(k + 1) % 3] - point, corners[(k + 2) % 3] - point) @ normal
        for k in range(3)
    ]
    shares = np.array(areas) / (normal @ normal)
    height = (point - corners[0]) @ normal / np.linalg.norm(normal)
    return shares.min() > -EDGE and abs(height) < EDGE * np.sqrt(np.linalg.norm(normal))


def shown_large(qtbot, window, name):
    """A view in landmark mode, of the brain without its landmarks, with faces larger than pixels."""
    view = getattr(window.view_area, name)
    press(qtbot, window, Qt.Key.Key_V)  # landmarks would be clicked, not the surface
    press(qtbot, window, Qt.Key.Key_Space)
    if isinstance(view, SurfaceView):
        view.canvas.renderer.GetActiveCamera().Azimuth(20)
    view.canvas.zoom_at(None, 3.0)
    view.canvas.pan(QPointF(0, 0.4 * view.canvas.height()))
    view.canvas.camera_moved.emit()
    view.canvas.refresh()
    QApplication.processEvents()
    return view


def clicks_on(qtbot, window, view, layer):
    """Click at random places where one face is drawn; yield the place, the face, the pair made."""
    drawn, rng, clicks = DrawnFaces(view.canvas, layer), np.random.default_rng(5), 0
    while clicks < CLICKS:
        x, y = (int(rng.integers(1, size)) for size in (drawn.width, drawn.height))
        # the mouse is at the corner between four pixels
        (face, *others) = (drawn.at(x - a, y - b) for a in (0, 1) for b in (0, 1))
        if face is None or set(others) != {face}:
            continue
        clicks += 1
        qtbot.mouseClick(view.canvas, LEFT, pos=QPoint(x, y))
        yield QPoint(x, y), face, window.session.project.pairs[-1]
        press(qtbot, window, Qt.Key.Key_Escape)
        assert window.session.project.pairs == ()


@pytest.mark.parametrize("role", ["source", "target"])
def test_each_click_in_landmark_mode_ends_on_the_face_that_is_drawn_there(qtbot, window, role):
    surface = getattr(window.session.results, role).surface
    view = shown_large(qtbot, window, role)
    for place, face, pair in clicks_on(qtbot, window, view, view.surface):
        end = np.array(getattr(pair, role))
        assert inside(end, surface.vertices[surface.faces[face]]), (place, face)


@pytest.mark.parametrize("half", ["anterior", "posterior"])
def test_each_click_in_a_flat_half_begins_on_the_face_of_the_source_that_is_drawn_there(
    qtbot, window, half
):
    source = window.session.results.source
    in_half = source.flat.dissection.piece_of_face == ("anterior", "posterior").index(half)
    faces = source.surface.faces[in_half]
    view = shown_large(qtbot, window, half)
    for place, face, pair in clicks_on(qtbot, window, view, view._source):
        assert inside(np.array(pair.source), source.surface.vertices[faces[face]]), (place, face)


def test_each_click_on_the_registered_brain_ends_on_the_target_where_it_was_made(qtbot, window):
    """The point is one of the target's, so it is seen at the mouse, and not on the far side."""
    registered = window.session.results.registration.surface
    view = shown_large(qtbot, window, "registered")
    for place, face, pair in clicks_on(qtbot, window, view, view.surface):
        ends = np.vstack([pair.target, registered.vertices[registered.faces[face]]])
        pixels, depths = view.canvas.to_pixels(ends)
        assert np.hypot(*(pixels[0] - place.toTuple())) < 3.0
        assert np.abs(depths[1:] - depths[0]).min() < 0.02 * view.diagonal
