"""One cursor: pointing at a place in one view marks it in all others."""

from __future__ import annotations

import numpy as np
import pytest

from flyreg_core import edits

pytest.importorskip("PySide6")
from PySide6.QtCore import QEvent, QPoint
from PySide6.QtWidgets import QApplication

from tests.app.hands import hover, pixel, settle

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]


def point_at(qtbot, window, view, position):
    """Move the mouse there, and wait until the mark has followed."""
    hover(window, view.canvas, position)
    qtbot.waitUntil(lambda: not window.view_area.pointer._timer.isActive())


def marked(window, view):
    return window.view_area.pointer.point_in(view)


def a_front_face(window):
    """A place of the source that can be seen, well inside the anterior half."""
    view = window.view_area.source
    center = view.canvas.rect().center()
    return center - QPoint(view.canvas.width() // 8, view.canvas.height() // 20)


def test_what_is_pointed_at_on_one_brain_is_marked_on_the_others(qtbot, window):
    area, results = window.view_area, window.session.results
    point_at(qtbot, window, area.source, a_front_face(window))
    assert marked(window, area.source) is None  # the mouse is there itself
    place = area.pointer.place
    surface = results.registration.surface
    expected = place.source.barycentric @ surface.vertices[surface.faces[place.source.face]]
    np.testing.assert_allclose(marked(window, area.registered), expected, atol=1e-9)
    there = marked(window, area.target)
    squared, _, _ = results.target.surface.tree.nearest(there[None])
    assert squared[0] < 1e-12  # on the target's surface, where the registration has it
    assert np.linalg.norm(there - expected) < 0.05 * results.target.surface.diagonal
    assert marked(window, area.anterior) is not None
    assert marked(window, area.posterior) is None
    assert "anterior half" in window.status.place.text()
    assert f"{there[0]:.1f}" in window.status.place.text()


def test_pointing_at_the_mark_in_another_view_points_back(qtbot, window):
    area, results = window.view_area, window.session.results
    start = a_front_face(window)
    point_at(qtbot, window, area.source, start)
    first = area.pointer.place.source.on(results.source.surface)
    for view in (area.target, area.registered, area.anterior):
        point_at(qtbot, window, area.source, start)
        there = pixel(view.canvas, marked(window, view))  # rounded to a pixel
        reach = 4 * area.source.canvas.micrometres_per_pixel()
        point_at(qtbot, window, view, there)
        assert marked(window, view) is None
        assert np.linalg.norm(marked(window, area.source) - first) < 3 * reach


def test_the_marks_go_with_the_mouse_and_cost_no_run(qtbot, window):
    area, before = window.view_area, window.session.results
    point_at(qtbot, window, area.anterior, pixel(area.anterior.canvas, (0.5, 0.7, 0.0)))
    assert all(marked(window, view) is not None for view in area.surface_views)
    QApplication.sendEvent(area.anterior.canvas, QEvent(QEvent.Type.Leave))
    assert all(marked(window, view) is None for view in area.views)
    assert window.status.place.text() == ""
    assert window.session.results is before


def test_beside_the_brain_and_in_the_hole_nothing_is_marked(qtbot, window):
    area = window.view_area
    for view, position in (
        (area.source, QPoint(3, 3)),
        (area.anterior, pixel(area.anterior.canvas, (0.0, 0.0, 0.0))),
    ):
        point_at(qtbot, window, area.target, a_front_face(window))
        point_at(qtbot, window, view, position)
        assert area.pointer.place is None
        assert all(marked(window, other) is None for other in area.views)


def test_following_the_mouse_draws_no_scene_anew(qtbot, window):
    area, drawings = window.view_area, []
    point_at(qtbot, window, area.source, a_front_face(window))
    QApplication.processEvents()
    for view in area.views:
        view.canvas.renderer.AddObserver("EndEvent", lambda *_: drawings.append(1))
    mark = area.pointer.marks[area.target]
    for step in range(1, 8):
        before = mark.point
        point_at(qtbot, window, area.source, a_front_face(window) + QPoint(2 * step, step))
        assert not np.array_equal(mark.point, before)
        QApplication.processEvents()
    assert drawings == []
    center = mark.pos() + QPoint(mark.width() // 2, mark.height() // 2) - area.target.canvas.pos()
    shown = pixel(area.target.canvas, mark.point)
    assert (shown - center).manhattanLength() <= 2


def test_lambda_draws_only_the_views_in_which_something_moves(qtbot, window):
    area, drawn = window.view_area, []
    settle(qtbot, window)
    for view in area.views:
        view.canvas.renderer.AddObserver("EndEvent", lambda *_, view=view: drawn.append(view))
    window.session.begin_gesture()
    project = edits.set_smoothing(window.session.project, 0.5)
    window.session.edit("change smoothing", project)
    moving = {area.registered, *area.flat_views}
    qtbot.waitUntil(lambda: window.session.is_up_to_date and moving <= set(drawn))
    qtbot.wait(100)
    assert set(drawn) == moving
    window.session.end_gesture()
    settle(qtbot, window)
