"""Trim planes and the cut, dragged in the views."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("PySide6")
from PySide6.QtCore import QPoint, Qt

from tests.app.hands import CONTROL, LEFT, drawn, pixel, press, settle

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]


@pytest.fixture
def trimming(qtbot, window):
    press(qtbot, window, Qt.Key.Key_P)
    assert window.trim.is_on
    return window


def place_of(window, knob, role="source"):
    view = window.view_area.trim_views.of[role]
    return view.view.canvas, pixel(view.view.canvas, view.place_of(knob))


def grey(window):
    colors = np.array(window.view_area.source.surface.polydata.point_data["color"]).astype(int)
    return int((np.ptp(colors, axis=1) == 0).sum())


def test_a_plane_is_dragged_with_a_preview_into_one_edit_that_undo_takes_back(qtbot, trimming):
    window = trimming
    before = window.session.results.source.surface
    raw = window.session.results.source.raw
    assert len(drawn(window.view_area.source)) == len(raw.vertices)
    canvas, start = place_of(window, "right")
    middle = place_of(window, "left")[1]
    step = (middle - start) / 10
    cut_off = [grey(window)]
    qtbot.mousePress(canvas, LEFT, pos=start)
    for number in (1, 2):
        qtbot.mouseMove(canvas, start + number * step)
        cut_off.append(grey(window))
        assert "µm right of the midplane" in window.status.hint.text()
        assert window.session.undo_stack.count() == 0
    assert cut_off == sorted(set(cut_off))
    qtbot.mouseRelease(canvas, LEFT, pos=start + 2 * step)
    assert window.session.undo_stack.count() == 1
    found = window.session.results.source.torus.planes.right
    assert window.session.project.source.trim.right > found + 5
    assert window.session.project.source.trim.left is None
    settle(qtbot, window)
    assert len(window.session.results.source.surface.vertices) < len(before.vertices)
    right = window.session.project.source.trim.right
    assert float(window.steps.form.source.right.text()) == right
    assert not window.steps.form.apply_button.isEnabled()
    press(qtbot, window, Qt.Key.Key_Z, CONTROL)
    settle(qtbot, window)
    np.testing.assert_array_equal(window.session.results.source.surface.vertices, before.vertices)
    press(qtbot, window, Qt.Key.Key_P)
    assert len(drawn(window.view_area.source)) == len(before.vertices)


def test_the_cut_is_dragged_and_a_double_click_puts_it_back(qtbot, trimming):
    window = trimming
    canvas, start = place_of(window, "cut")
    axis = window.session.results.source.frame.axes[2]
    view = window.view_area.trim_views.of["source"]
    before = view.place_of("cut")
    end = pixel(canvas, before + 12 * axis)
    qtbot.mousePress(canvas, LEFT, pos=start)
    qtbot.mouseMove(canvas, end)
    qtbot.mouseRelease(canvas, LEFT, pos=end)
    asked = window.session.project.source.cut.shift_um
    assert asked == pytest.approx(12, abs=5)  # a pixel is 3 µm of it
    settle(qtbot, window)
    made = window.session.results.source.flat.dissection.shift_um
    assert asked / 2 <= made <= asked  # in a brain of so few voxels not always all of it
    canvas, place = place_of(window, "cut")
    assert (place - pixel(canvas, before + made * axis)).manhattanLength() <= 2
    qtbot.mouseDClick(canvas, LEFT, pos=place)
    assert window.session.project.source.cut.shift_um == 0
    assert window.session.undo_stack.count() == 2


def test_esc_puts_back_what_is_held_and_nothing_is_edited(qtbot, trimming):
    window = trimming
    canvas, start = place_of(window, "left")
    qtbot.mousePress(canvas, LEFT, pos=start)
    qtbot.mouseMove(canvas, start + QPoint(-9, 3))
    press(qtbot, window, Qt.Key.Key_Escape)
    qtbot.mouseRelease(canvas, LEFT, pos=start + QPoint(-9, 3))
    assert window.session.undo_stack.count() == 0
    assert window.trim.is_on
    assert (place_of(window, "left")[1] - start).manhattanLength() < 3


def test_a_click_without_a_move_changes_nothing_and_beside_the_dots_the_camera_turns(
    qtbot, trimming
):
    window = trimming
    canvas, start = place_of(window, "left")
    qtbot.mouseClick(canvas, LEFT, pos=start)
    assert window.session.undo_stack.count() == 0
    camera = canvas.renderer.GetActiveCamera()
    before = camera.GetPosition()
    corner = QPoint(15, canvas.height() - 15)
    qtbot.mousePress(canvas, LEFT, pos=corner)
    qtbot.mouseMove(canvas, corner + QPoint(40, 0))
    qtbot.mouseRelease(canvas, LEFT, pos=corner + QPoint(40, 0))
    assert camera.GetPosition() != before


def test_all_can_be_left_to_the_program_again(qtbot, trimming):
    window = trimming
    before = window.session.project
    assert not window.steps.trimming.reset_button.isEnabled()
    canvas, start = place_of(window, "left")
    qtbot.mousePress(canvas, LEFT, pos=start)
    qtbot.mouseMove(canvas, start + QPoint(-8, 0))
    qtbot.mouseRelease(canvas, LEFT, pos=start + QPoint(-8, 0))
    assert window.session.project != before
    qtbot.mouseClick(window.steps.trimming.reset_button, LEFT)
    assert window.session.project == before
    settle(qtbot, window)
