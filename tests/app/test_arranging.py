"""Views are hidden, arranged, cut, blinked and looked at from all sides, and stay so."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("PySide6")
from flyreg_gui.preferences import Preferences
from flyreg_gui.view_state import read_view_state, view_state
from flyreg_gui.views.arrangement import LAYOUTS
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QCursor
from PySide6.QtWidgets import QApplication

from tests.app.hands import LEFT, drag, drawn, press
from tests.app.picks import surface_mispicks

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]


def shown(window):
    return [number for number, frame in enumerate(window.view_area.frames) if frame.isVisible()]


def seen_from(view):
    """The direction from a brain to the camera, towards its left, dorsal, anterior."""
    pose = view.pose()
    away = np.array(pose.position) - pose.focal_point
    return away / np.linalg.norm(away)


def test_views_are_hidden_maximised_and_arranged_and_the_files_remember(qtbot, window):
    arrangement, title = window.view_area.arrangement, window.view_area.frames[1].title
    qtbot.mouseDClick(title, LEFT)
    assert shown(window) == [1]
    qtbot.mouseDClick(title, LEFT)
    assert shown(window) == [0, 1, 2, 3, 4]
    arrangement.set_shown(1, False)
    assert shown(window) == [0, 2, 3, 4]
    arrangement.toggle_maximised(window.view_area.frames[2])
    assert shown(window) == [2]
    arrangement.toggle_maximised(window.view_area.frames[2])
    assert shown(window) == [0, 2, 3, 4]
    state = view_state(window)
    arrangement.take(LAYOUTS[-1])
    assert shown(window) == list(LAYOUTS[-1].shown)
    read_view_state(window, state)
    assert shown(window) == [0, 2, 3, 4]
    for number in range(5):
        arrangement.set_shown(number, False)
    assert len(shown(window)) == 1  # the last one stays
    Preferences().views = arrangement.state()
    arrangement.take(LAYOUTS[0])
    arrangement.restore(Preferences().views)
    assert len(shown(window)) == 1
    for damaged in (None, {}, {"shown": ["a"]}, {"shown": [77], "sizes": 3, "is_beside": "no"}):
        arrangement.restore(damaged)
        assert len(shown(window)) == 1


def test_keys_look_from_each_side_copy_views_and_link_rotations_only(qtbot, window):
    area = window.view_area
    left, dorsal, anterior = np.eye(3)
    for key, expected in (
        (Qt.Key.Key_2, -anterior),
        (Qt.Key.Key_3, left),
        (Qt.Key.Key_4, -left),
        (Qt.Key.Key_5, dorsal),
        (Qt.Key.Key_6, -dorsal),
        (Qt.Key.Key_1, anterior),
    ):
        press(qtbot, window, key)
        for view in area.surface_views:
            np.testing.assert_allclose(seen_from(view), expected, atol=1e-9)
    frame = window.session.results.source.frame
    press(qtbot, window, Qt.Key.Key_3)
    camera = area.source.canvas.renderer.GetActiveCamera()
    place = frame.coordinates(np.array(camera.GetPosition()))
    assert place[0] > 5 * np.abs(place[1:]).max()  # really at the animal's left
    window.actions_by_name["link"].setChecked(False)
    area.source.look_from("back")
    press(qtbot, window, Qt.Key.Key_Q)  # the mouse is over no brain: the source counts
    np.testing.assert_allclose(seen_from(area.target), -anterior, atol=1e-9)
    window.actions_by_name["link"].setChecked(True)
    keep_their_distance_when_linked_by_rotation_only(qtbot, window)


def keep_their_distance_when_linked_by_rotation_only(qtbot, window):
    area = window.view_area
    window.actions_by_name["rotation_only"].setChecked(True)
    cameras = [view.canvas.renderer.GetActiveCamera() for view in area.surface_views]
    cameras[1].Dolly(2.0)
    before = [camera.GetDistance() for camera in cameras]
    middle = area.source.canvas.rect().center()
    drag(qtbot, area.source.canvas, [middle, middle + QPoint(60, 20)], lambda: None)
    np.testing.assert_allclose([c.GetDistance() for c in cameras], before, rtol=1e-6)
    np.testing.assert_allclose(seen_from(area.target), seen_from(area.source), atol=1e-9)


def test_f_brings_what_is_under_the_mouse_to_the_middle(qtbot, window):
    canvas = window.view_area.source.canvas
    position = canvas.rect().center() - QPoint(canvas.width() // 8, canvas.height() // 20)
    point = window.view_area.source.point_at(QPointF(position))
    QCursor.setPos(canvas.mapToGlobal(position))  # the display's own: the key asks where it is
    qtbot.waitUntil(lambda: canvas.underMouse() and window.status.place.text() != "")
    press(qtbot, window, Qt.Key.Key_F)
    pixels, _ = canvas.to_pixels(np.array([point]))
    np.testing.assert_allclose(pixels[0], [canvas.width() / 2, canvas.height() / 2], atol=1.0)


def test_landmarks_are_hidden_and_resized_by_keys_and_blinking_ends_as_it_began(qtbot, window):
    view = window.view_area.source
    assert view._markers.actor.GetVisibility()
    radius = view._radii[0]
    press(qtbot, window, Qt.Key.Key_Plus)
    assert view._radii[0] > radius
    press(qtbot, window, Qt.Key.Key_Minus)
    assert view._radii[0] == pytest.approx(radius)
    press(qtbot, window, Qt.Key.Key_V)
    assert not view._markers.actor.GetVisibility()
    assert view.landmark_at(QPointF(view.canvas.rect().center())) is None
    press(qtbot, window, Qt.Key.Key_V)
    assert view._markers.actor.GetVisibility()
    layer, action = window.view_area.registered.overlay, window.actions_by_name["blink_target"]
    before = layer.actor.prop.opacity
    seen = set()
    press(qtbot, window, Qt.Key.Key_J)
    qtbot.waitUntil(lambda: seen.add(layer.actor.prop.opacity) or seen >= {0.0, 1.0})
    press(qtbot, window, Qt.Key.Key_J)
    assert not action.isChecked()
    assert layer.actor.prop.opacity == before


def test_a_cut_opens_all_brains_and_what_is_cut_away_cannot_be_clicked(qtbot, window):
    """The drawn faces, as the graphics hardware says, are those that clicks mean, also when cut."""
    area, results = window.view_area, window.session.results
    canvas = area.source.canvas
    position = QPointF(canvas.rect().center() - QPoint(canvas.width() // 8, canvas.height() // 20))
    assert area.source.point_at(position) is not None
    press(qtbot, window, Qt.Key.Key_K)
    assert area.cut_bar.isVisible()
    assert area.source.point_at(position) is None  # its inside is seen there
    frame = results.source.frame
    clip = area.source.pickable_surface._clip
    depth = frame.coordinates(clip.origin)[2]
    along = frame.coordinates(results.source.surface.vertices)[:, 2]
    assert depth == pytest.approx((along.min() + along.max()) / 2)
    area.cut_bar.axis.setCurrentIndex(1)  # left-right: the animal's left is taken away
    QApplication.processEvents()
    for view in (area.source, area.target):
        assert surface_mispicks(view, 60, 3) == []
    hidden = [
        m.pair.id
        for m in results.landmarks
        if frame.coordinates(m.source_point)[0] > frame.coordinates(clip.origin)[0] + 5
    ]
    for mark in results.landmarks:
        pixels, _ = canvas.to_pixels(mark.source_point[None])
        assert area.source.landmark_at(QPointF(*pixels[0])) not in hidden
    press(qtbot, window, Qt.Key.Key_K)
    assert area.source.point_at(position) is not None


def test_each_brain_is_shown_as_read_prepared_or_smoothed(qtbot, window):
    area, brain = window.view_area, window.session.results.source
    offered = area.frames[0].title.choice.menu().actions()
    before = area.source.pose()
    for row, vertices in ((1, brain.raw.vertices), (0, brain.surface.vertices)):
        offered[row].trigger()
        np.testing.assert_array_equal(drawn(area.source), vertices.astype(np.float32))
        assert area.source.pose() == before
    offered[2].trigger()
    smoothed = drawn(area.source)
    assert smoothed.shape == brain.surface.vertices.shape
    assert np.ptp(smoothed, axis=0).max() < np.ptp(brain.surface.vertices, axis=0).max()
    middle = QPointF(area.source.canvas.rect().center() - QPoint(30, 10))
    assert area.pointer.at(area.source, middle) is None  # it is not the surface that is registered
