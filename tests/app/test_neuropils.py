"""Neuropils in the views: drawn in the brain they belong to, named, and out of the way when asked."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import trimesh

pytest.importorskip("PySide6")
from flyreg_gui.theme import NEUROPILS
from flyreg_gui.views.canvas import Canvas
from flyreg_gui.views.neuropil_views import colors_of_names
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication

from flyreg_core import edits
from flyreg_core.neuropils import open_neuropils
from flyreg_core.transform import carry
from tests.app.hands import hover, pixel, press, pulling_aside, settle

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]
RADIUS = 25.0


def ball_inside(brain):
    """A ball in the middle of a brain's left side, hidden behind its surface."""
    half = brain.frame.axes[0] * 0.22 * np.ptp(brain.surface.vertices @ brain.frame.axes[0])
    ball = trimesh.creation.icosphere(3, RADIUS)
    ball.apply_translation(brain.surface.vertices.mean(axis=0) + half)
    return ball


def load(qtbot, window, tmp_path, role, names=("AL_L",), inside_out=False):
    """Load a file with one ball for each name; return where the first is."""
    brain = getattr(window.session.results, role)
    balls = []
    for number, _ in enumerate(names):
        ball = ball_inside(brain)
        ball.apply_translation(-3 * RADIUS * number * brain.frame.axes[0])
        if inside_out:
            ball.invert()
        balls.append(ball)
    path = tmp_path / f"{role}.obj"
    lines, start = [], 1
    for name, ball in zip(names, balls, strict=True):
        lines.append(f"g {name}")
        lines += ["v {} {} {}".format(*vertex) for vertex in ball.vertices]
        lines += ["f {} {} {}".format(*face) for face in ball.faces + start]
        start += len(ball.vertices)
    path.write_text("\n".join(lines))
    project = edits.add_neuropils(window.session.project, open_neuropils(path, role, "um"))
    window.session.edit("load neuropils", project)
    settle(qtbot, window)
    return balls[0].center_mass


def picture(canvas: Canvas) -> np.ndarray:
    """What is drawn in a view, (rows, columns, 3)."""
    canvas.render()
    QApplication.processEvents()
    image = canvas.grabFramebuffer().convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    return rows[:, : 3 * image.width()].reshape(image.height(), -1, 3).astype(int)


@pytest.mark.parametrize("inside_out", [False, True])
def test_a_neuropil_is_seen_through_its_brain_where_it_lies_and_only_there(
    qtbot, window, tmp_path, inside_out
):
    area = window.view_area
    press(qtbot, window, Qt.Key.Key_V)  # landmarks would lie before it
    before = {view: picture(view.canvas) for view in area.surface_views}
    center = load(qtbot, window, tmp_path, "target", inside_out=inside_out)
    for view in (area.target, area.registered):
        after = picture(view.canvas)
        rows, columns = np.nonzero(np.abs(after - before[view]).sum(axis=2) > 12)
        ratio = view.canvas.devicePixelRatioF()
        pixels, _ = view.canvas.to_pixels(center[None])
        away = np.hypot(columns - ratio * pixels[0, 0], rows - ratio * pixels[0, 1])
        radius = RADIUS / view.canvas.micrometres_per_pixel() * ratio
        assert len(rows) > 0.8 * np.pi * radius**2
        assert away.max() < 1.3 * radius
        tint = after[rows, columns].mean(axis=0) - before[view][rows, columns].mean(axis=0)
        wanted = np.array(NEUROPILS[0]) - before[view][rows, columns].mean(axis=0)
        assert tint @ wanted > 0.5 * np.linalg.norm(tint) * np.linalg.norm(wanted)
    assert np.array_equal(picture(area.source.canvas), before[area.source])
    press(qtbot, window, Qt.Key.Key_I)
    for view in area.surface_views:
        assert np.array_equal(picture(view.canvas), before[view])


def test_neuropils_are_named_in_a_legend_and_under_the_mouse(qtbot, window, tmp_path):
    area, action = window.view_area, window.actions_by_name["show_neuropils"]
    assert not action.isEnabled()
    center = load(qtbot, window, tmp_path, "source", ("AL_L", "AL_R"))
    assert action.isEnabled()
    names = area.frames[0].names
    assert names.isVisible()
    assert "AL_L" in names.text()
    assert "AL_R" in names.toolTip()
    assert not area.frames[1].names.isVisible()
    canvas = area.source.canvas
    hover(window, canvas, pixel(canvas, center))
    qtbot.waitUntil(lambda: canvas.toolTip() == "AL_L")
    hover(window, canvas, QPoint(3, canvas.height() - 3))
    qtbot.waitUntil(lambda: canvas.toolTip() == "")
    action.trigger()
    assert not names.isVisible()
    window.session.undo_stack.undo()
    settle(qtbot, window)
    assert not action.isEnabled()


def test_a_neuropil_of_the_source_goes_along_to_the_registered_view_and_follows_the_map(
    qtbot, window, tmp_path
):
    area = window.view_area
    center = load(qtbot, window, tmp_path, "source")
    qtbot.waitUntil(lambda: "AL_L (source)" in window.carried.by_name)
    wanted = carry(center[None], window.session.results, np.inf).points[0]
    place = pixel(area.registered.canvas, wanted).toPointF()
    assert area.registered.neuropil_at(place) is not None
    assert area.target.neuropil_at(pixel(area.target.canvas, wanted).toPointF()) is None
    hover(window, area.registered.canvas, place.toPoint())
    qtbot.waitUntil(lambda: area.registered.canvas.toolTip() == "AL_L")
    assert not area.frames[2].names.isVisible()  # the source's view has named it
    before = window.carried.by_name["AL_L (source)"]
    mine = pulling_aside(window.session.results, center)
    window.session.edit("add mine", edits.add_pair(window.session.project, mine))
    settle(qtbot, window)
    qtbot.waitUntil(lambda: window.carried.by_name["AL_L (source)"] is not before)
    after = window.carried.by_name["AL_L (source)"]
    assert np.abs(after.surface.vertices - before.surface.vertices).max() > 0.01
    own = window.neuropils.by_name["AL_L (source)"].surface.vertices
    there = carry(own, window.session.results, np.inf).points
    np.testing.assert_array_equal(after.surface.vertices, there)
    window.session.undo_stack.setIndex(0)
    settle(qtbot, window)
    assert not window.carried.by_name
    assert area.registered.neuropil_at(place) is None


def test_what_a_cut_takes_away_is_not_under_the_mouse(qtbot, window, tmp_path):
    center = load(qtbot, window, tmp_path, "source")
    view = window.view_area.source
    place = pixel(view.canvas, center).toPointF()
    assert view.neuropil_at(place) is not None
    bar = window.view_area.cut_bar
    window.actions_by_name["cut_through"].trigger()
    seen = []
    for share in (bar.place.minimum(), bar.place.maximum()):
        bar.place.setValue(share)
        seen.append(view.neuropil_at(place) is not None)
    assert sorted(seen) == [False, True]


def test_a_name_has_one_colour_in_both_brains_and_neighbours_differ():
    names = [f"region {number}" for number in range(2 * len(NEUROPILS))]
    colors = colors_of_names([*names, *names])
    assert list(colors) == names
    assert len(set(colors.values())) == len(NEUROPILS)
    assert all(colors[a] != colors[b] for a, b in pairwise(names))
