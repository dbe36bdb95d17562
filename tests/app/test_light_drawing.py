"""What is slow to draw has fewer triangles while a hand moves it; what is hidden is not drawn at all."""

import itertools
from functools import partial

import numpy as np
import pytest

pytest.importorskip("PySide6")
import pyvista as pv
from flyreg_gui.status import FEWER
from flyreg_gui.views import canvas as canvas_module
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt, QTimer
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QApplication, QStyle, QStyleOptionSlider

from tests.app.hands import LEFT, open_with_a_pull, pixel, settle

pytestmark = pytest.mark.window


@pytest.fixture
def slow(monkeypatch):
    """A machine on which every scene takes too long to draw."""
    monkeypatch.setattr(canvas_module, "SLOW_MS", 0.0)


def handle_of(slider):
    """Where the handle of a slider is."""
    option = QStyleOptionSlider()
    slider.initStyleOption(option)
    place = slider.style().subControlRect(
        QStyle.ComplexControl.CC_Slider, option, QStyle.SubControl.SC_SliderHandle, slider
    )
    return place.center()


def given_to_vtk(layer):
    """The vertices and the number of triangles that VTK draws of a layer."""
    mesh = pv.wrap(layer.actor.mapper.GetInput())
    return np.array(mesh.points), mesh.n_cells


def is_other(layer, points):
    """Whether VTK draws a layer with other vertices than these."""
    return not np.array_equal(given_to_vtk(layer)[0], points)


def is_drawn(layer, vertices, triangles):
    """Whether VTK draws so many triangles of a layer, over these vertices."""
    points, drawn = given_to_vtk(layer)
    shown = points[:, : vertices.shape[1]]
    return drawn == triangles and np.array_equal(shown, vertices.astype(np.float32))


def is_drawn_of(layer, vertices):
    """Whether all vertices that VTK draws of a layer are some of these."""
    points, _ = given_to_vtk(layer)
    known = {tuple(row) for row in vertices.astype(np.float32)}
    return all(tuple(row) in known for row in points[:, : vertices.shape[1]])


def moved_layers(window):
    """The layers of the source where registration takes it, with where their vertices belong."""
    registration, area = window.session.results.registration, window.view_area
    halves = registration.halves
    return [
        (area.registered, area.registered.surface, registration.surface.vertices),
        (area.anterior, area.anterior._source, halves["anterior"].plane),
        (area.posterior, area.posterior._source, halves["posterior"].plane),
    ]


def wait_until_drawn(qtbot, window):
    """Wait until what was asked for is on the screen."""
    qtbot.waitUntil(lambda: window.session.is_up_to_date)
    QApplication.processEvents()


def drag_slider(qtbot, slider, steps):
    """Press the handle of a slider and move it; the button stays pressed."""
    start = handle_of(slider)
    qtbot.mousePress(slider, LEFT, pos=start)
    qtbot.mouseMove(slider, start + QPoint(steps, 0))


def test_while_lambda_is_dragged_fewer_triangles_follow_and_all_when_it_is_let_go(
    qtbot, window, slow
):
    open_with_a_pull(qtbot, window)
    slider = window.landmarks.smoothing_slider
    whole = [given_to_vtk(layer) for _, layer, _ in moved_layers(window)]
    drag_slider(qtbot, slider, 30)
    wait_until_drawn(qtbot, window)
    for (_, layer, vertices), (before, triangles) in zip(moved_layers(window), whole, strict=True):
        qtbot.waitUntil(partial(is_drawn_of, layer, vertices))
        points, fewer = given_to_vtk(layer)
        assert 100 < fewer < triangles / 2
        assert not {tuple(row) for row in points} <= {tuple(row) for row in before}
    assert FEWER in window.status.state.text()
    qtbot.mouseRelease(slider, LEFT, pos=handle_of(slider))
    settle(qtbot, window)
    assert FEWER not in window.status.state.text()
    for (_, layer, vertices), (_, triangles) in zip(moved_layers(window), whole, strict=True):
        qtbot.waitUntil(partial(is_drawn, layer, vertices, triangles))


@pytest.fixture
def moments(window):
    """What happens in a window, in turn: "drawn" for each picture, "answered" for each event loop."""
    happened = []
    for view in window.view_area.views:
        view.canvas.renderer.AddObserver("EndEvent", lambda *_: happened.append("drawn"))
    beat = QTimer()
    beat.timeout.connect(lambda: happened.append("answered"))
    beat.start(0)
    yield happened
    beat.stop()


def test_between_two_slow_pictures_the_window_answers(qtbot, window, slow, moments):
    open_with_a_pull(qtbot, window)
    slider = window.landmarks.smoothing_slider
    drag_slider(qtbot, slider, 30)
    wait_until_drawn(qtbot, window)
    moments.clear()
    for step in range(31, 40):
        qtbot.mouseMove(slider, handle_of(slider) + QPoint(step - 30, 0))
        wait_until_drawn(qtbot, window)
    qtbot.waitUntil(lambda: moments.count("drawn") > 10)
    pairs = list(itertools.pairwise(moments))
    assert ("drawn", "answered") in pairs
    assert ("drawn", "drawn") not in pairs
    qtbot.mouseRelease(slider, LEFT, pos=handle_of(slider))


def test_while_slow_pictures_are_drawn_no_run_begins(qtbot, window, slow, moments):
    open_with_a_pull(qtbot, window)
    slider = window.landmarks.smoothing_slider
    drag_slider(qtbot, slider, 30)
    wait_until_drawn(qtbot, window)
    window.session.results_changed.connect(lambda _results: moments.append("results"))
    moments.clear()
    for step in range(31, 45):
        qtbot.mouseMove(slider, handle_of(slider) + QPoint(step - 30, 0))
        qtbot.wait(20)
    wait_until_drawn(qtbot, window)
    news = [what for what in moments if what != "answered"]
    moving = len(moved_layers(window))
    runs = "".join(what[0] for what in news).split("r")[1:-1]
    assert len(runs) > 2
    assert all(drawn == moving * "d" for drawn in runs)
    qtbot.mouseRelease(slider, LEFT, pos=handle_of(slider))


def test_views_that_are_hidden_hold_nothing_up(qtbot, window, slow):
    open_with_a_pull(qtbot, window)
    slider = window.landmarks.smoothing_slider
    drag_slider(qtbot, slider, 30)
    wait_until_drawn(qtbot, window)
    for frame in window.view_area.frames:
        frame.hide()
    for value in (slider.value() + 20, slider.value() + 40):
        slider.setValue(value)
        wait_until_drawn(qtbot, window)
    qtbot.mouseRelease(slider, LEFT, pos=handle_of(slider))


def test_what_is_drawn_fast_enough_stays_whole_under_the_hand(qtbot, window, monkeypatch):
    monkeypatch.setattr(canvas_module, "SLOW_MS", np.inf)
    slider = window.landmarks.smoothing_slider
    whole = [given_to_vtk(layer)[1] for _, layer, _ in moved_layers(window)]
    drag_slider(qtbot, slider, 30)
    wait_until_drawn(qtbot, window)
    assert [given_to_vtk(layer)[1] for _, layer, _ in moved_layers(window)] == whole
    assert FEWER not in window.status.state.text()
    qtbot.mouseRelease(slider, LEFT, pos=handle_of(slider))


def test_a_press_that_moves_nothing_leaves_all_triangles(qtbot, window, slow):
    slider, layer = window.landmarks.smoothing_slider, window.view_area.registered.surface
    triangles = given_to_vtk(layer)[1]
    qtbot.mousePress(slider, LEFT, pos=handle_of(slider))
    window.view_area.registered.canvas.refresh()
    qtbot.waitUntil(lambda: given_to_vtk(layer)[1] < triangles)
    qtbot.mouseRelease(slider, LEFT, pos=handle_of(slider))
    qtbot.waitUntil(lambda: given_to_vtk(layer)[1] == triangles)


def test_brains_that_are_turned_have_fewer_triangles_until_the_button_is_released(
    qtbot, window, slow
):
    layers = [view.surface for view in window.view_area.surface_views]
    whole = [given_to_vtk(layer)[1] for layer in layers]
    canvas = window.view_area.target.canvas
    start = canvas.rect().center()
    qtbot.mousePress(canvas, LEFT, pos=start)
    qtbot.mouseMove(canvas, start + QPoint(30, 10))
    for layer, triangles in zip(layers, whole, strict=True):
        qtbot.waitUntil(lambda layer=layer, n=triangles: given_to_vtk(layer)[1] < n)
    qtbot.mouseRelease(canvas, LEFT, pos=start + QPoint(30, 10))
    qtbot.waitUntil(lambda: [given_to_vtk(layer)[1] for layer in layers] == whole)


def test_a_turn_whose_release_another_window_got_is_over_when_the_mouse_comes_back(
    qtbot, window, slow
):
    canvas, layer = window.view_area.source.canvas, window.view_area.source.surface
    triangles = given_to_vtk(layer)[1]
    start = canvas.rect().center()
    qtbot.mousePress(canvas, LEFT, pos=start)
    qtbot.mouseMove(canvas, start + QPoint(30, 10))
    qtbot.waitUntil(lambda: given_to_vtk(layer)[1] < triangles)
    camera = canvas.renderer.GetActiveCamera()
    turned_to = camera.GetPosition()
    place = QPointF(start + QPoint(60, 20))
    back = QMouseEvent(
        *(QEvent.Type.MouseMove, place, canvas.mapToGlobal(place)),
        *(Qt.MouseButton.NoButton, Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier),
    )
    QApplication.sendEvent(canvas, back)
    qtbot.waitUntil(lambda: given_to_vtk(layer)[1] == triangles)
    assert camera.GetPosition() == turned_to
    qtbot.mouseRelease(canvas, LEFT, pos=start)
    assert camera.GetPosition() == turned_to


def test_brains_that_are_cut_by_hand_have_fewer_triangles_until_it_lets_go(qtbot, window, slow):
    area = window.view_area
    area.cut_bar.set_on(True)
    canvas, layer = area.target.canvas, area.target.surface
    triangles = given_to_vtk(layer)[1]
    start = pixel(canvas, area.cut_handles[1].dot)
    qtbot.mousePress(canvas, LEFT, pos=start)
    qtbot.mouseMove(canvas, start + QPoint(10, 10))
    qtbot.waitUntil(lambda: given_to_vtk(layer)[1] < triangles)
    qtbot.mouseRelease(canvas, LEFT, pos=start + QPoint(10, 10))
    qtbot.waitUntil(lambda: given_to_vtk(layer)[1] == triangles)


def test_the_wheel_is_over_when_it_has_stood_still_for_a_while(qtbot, window, slow):
    canvas, layer = window.view_area.source.canvas, window.view_area.source.surface
    triangles = given_to_vtk(layer)[1]
    place = QPointF(canvas.rect().center())
    notch = QWheelEvent(
        *(place, canvas.mapToGlobal(place), QPoint(), QPoint(0, 120), Qt.MouseButton.NoButton),
        *(Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False),
    )
    QApplication.sendEvent(canvas, notch)
    qtbot.waitUntil(lambda: given_to_vtk(layer)[1] < triangles)
    qtbot.waitUntil(lambda: given_to_vtk(layer)[1] == triangles)


def test_a_hidden_view_is_not_drawn_and_shows_the_newest_when_it_comes_back(qtbot, window):
    open_with_a_pull(qtbot, window)
    frames = window.view_area.frames[2:]
    before = [given_to_vtk(layer)[0] for _, layer, _ in moved_layers(window)]
    for frame in frames:
        frame.hide()
    window.landmarks.smoothing_slider.setValue(window.landmarks.smoothing_slider.value() + 40)
    settle(qtbot, window)
    for (_, layer, _), points in zip(moved_layers(window), before, strict=True):
        np.testing.assert_array_equal(given_to_vtk(layer)[0], points)
    for frame in frames:
        frame.show()
    for (_, layer, vertices), points in zip(moved_layers(window), before, strict=True):
        qtbot.waitUntil(lambda layer=layer, points=points: is_other(layer, points))
        now = given_to_vtk(layer)[0]
        np.testing.assert_array_equal(now[:, : vertices.shape[1]], vertices.astype(np.float32))
