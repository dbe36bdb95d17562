"""The plane that cuts the brains is dragged in the views, in step with its bar."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt

from tests.app.hands import LEFT, drag, hover, pixel, press

pytestmark = pytest.mark.window


@pytest.fixture
def area(qtbot, window):
    """The views, cut across the left-right axis."""
    press(qtbot, window, Qt.Key.Key_K)
    window.view_area.cut_bar.axis.setCurrentIndex(1)
    return window.view_area


def planes(area):
    """How far along its brain each view's plane is, as a share of the brain's extent."""
    for view in area.surface_views:
        along = view.space.axes[view.cut.axis]
        size = view.space.diagonal * view.space.size[view.cut.axis]
        yield (view._clip.origin - view.space.center) @ along / size + 0.5


def test_a_drag_of_the_dot_moves_the_plane_and_the_bar_together_in_all_views(qtbot, area):
    for number, view in enumerate(area.surface_views):
        area.cut_bar.set_share(0.5)
        handle, camera = area.cut_handles[number], view.canvas.renderer.GetActiveCamera()
        before = camera.GetPosition()
        start = pixel(view.canvas, handle.dot)
        seen = []

        def look(seen=seen, number=number):
            places = list(planes(area))
            assert places == pytest.approx([places[0]] * 3)
            assert area.cut_bar.cut.share == pytest.approx(places[0])
            seen.append(
                (pixel(area.surface_views[number].canvas, area.cut_handles[number].dot), places[0])
            )

        drag(qtbot, view.canvas, [start, start + QPoint(20, 3), start + QPoint(45, -4)], look)
        assert camera.GetPosition() == before
        assert seen[0][1] != seen[1][1] != 0.5
        for (dot, _), x in zip(seen, (20, 45), strict=True):
            assert dot.x() - start.x() == pytest.approx(x, abs=2)  # the dot follows the mouse
    for handle, view in zip(area.cut_handles, area.surface_views, strict=True):
        assert (handle.dot - view._clip.origin) @ view._clip.normal == pytest.approx(0, abs=1e-6)


def test_the_bar_moves_the_dot_and_a_double_click_puts_it_back(qtbot, area):
    handle, canvas = area.cut_handles[0], area.source.canvas
    middle = handle.dot
    area.cut_bar.set_share(0.6)
    assert not np.allclose(handle.dot, middle)
    qtbot.mouseDClick(canvas, LEFT, pos=pixel(canvas, handle.dot))
    assert area.cut_bar.cut.share == 0.5
    np.testing.assert_allclose(handle.dot, middle)


def test_seen_end_on_a_drag_upwards_brings_the_plane_nearer(qtbot, area):
    area.cut_bar.axis.setCurrentIndex(0)  # antero-posterior, seen from the front
    handle, canvas = area.cut_handles[1], area.target.canvas
    start = pixel(canvas, handle.dot)
    drag(qtbot, canvas, [start, start + QPoint(0, -12), start + QPoint(0, -25)], lambda: None)
    nearer = area.cut_bar.cut.share
    assert nearer > 0.5  # towards the anterior end, where the camera is
    assert nearer < 1


def test_beside_the_dot_and_without_a_cut_the_mouse_turns_the_brains(qtbot, window, area):
    canvas, camera = area.source.canvas, area.source.canvas.renderer.GetActiveCamera()
    dot = pixel(canvas, area.cut_handles[0].dot)
    before = camera.GetPosition()
    drag(qtbot, canvas, [dot + QPoint(0, 60), dot + QPoint(30, 60)], lambda: None)
    assert camera.GetPosition() != before
    assert area.cut_bar.cut.share == 0.5
    dot = pixel(canvas, area.cut_handles[0].dot)
    hover(window, canvas, dot)
    assert canvas.cursor().shape() == Qt.CursorShape.OpenHandCursor
    hover(window, canvas, dot + QPoint(0, 60))
    assert canvas.cursor().shape() == Qt.CursorShape.ArrowCursor
    press(qtbot, window, Qt.Key.Key_K)
    assert all(handle.dot is None for handle in area.cut_handles)
    assert not area.cut_handles[0].is_at(QPointF(dot))
