"""Clicks of a real mouse make landmarks on the very faces that are drawn under it."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
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


@pytest.mark.parametrize("role", ["source", "target"])
def test_each_click_in_landmark_mode_ends_on_the_face_that_is_drawn_there(qtbot, window, role):
    area, results, session = window.view_area, window.session.results, window.session
    view = getattr(area, role)
    surface = getattr(results, role).surface
    press(qtbot, window, Qt.Key.Key_V)  # landmarks would be clicked, not the surface
    press(qtbot, window, Qt.Key.Key_Space)
    canvas = view.canvas
    canvas.renderer.GetActiveCamera().Azimuth(20)
    canvas.zoom_at(None, 3.0)  # so that faces are larger than a pixel
    canvas.camera_moved.emit()
    canvas.refresh()
    QApplication.processEvents()
    drawn, rng, clicks = DrawnFaces(view), np.random.default_rng(5), 0
    while clicks < CLICKS:
        x, y = (int(rng.integers(1, size)) for size in (drawn.width, drawn.height))
        # the mouse is at the corner between four pixels
        (face, *others) = (drawn.at(x - a, y - b) for a in (0, 1) for b in (0, 1))
        if face is None or set(others) != {face}:
            continue
        clicks += 1
        qtbot.mouseClick(canvas, LEFT, pos=QPoint(x, y))
        end = getattr(session.project.pairs[-1], role)
        assert inside(np.array(end), surface.vertices[surface.faces[face]]), (x, y, face)
        press(qtbot, window, Qt.Key.Key_Escape)
        assert session.project.pairs == ()
