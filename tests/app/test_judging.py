"""Colours that judge a registration: true values, a legend, and no lag of the shape."""

from __future__ import annotations

import re

import numpy as np
import pytest

pytest.importorskip("PySide6")
from flyreg_gui.judging import ORIGINS, PLAIN, judge_by
from PySide6.QtCore import Qt

from flyreg_core.progress import ignore
from flyreg_core.seam import examine_seam
from flyreg_core.vertex_quantities import QUANTITIES, quantity_named
from tests.app.hands import LONG_MS, drag, drawn, open_with_a_pull, press, settle
from tests.app.test_window import slider_position

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]


def judged(qtbot, window, name):
    window.judging.choose(name)
    qtbot.waitUntil(lambda: window.judging.is_up_to_date, timeout=LONG_MS)
    return window.judging.judged


def colors_in(view):
    return np.array(view.surface.polydata.point_data["color"])


@pytest.mark.parametrize("quantity", QUANTITIES, ids=lambda quantity: quantity.name)
def test_each_quantity_has_a_value_for_each_vertex(results, quantity):
    values = quantity.compute(results, ignore)
    assert values.source.shape == (len(results.source.surface.vertices),)
    along_curves = {"seam": 0.01, "seam_angle": 0.01, "hole": 0.001}  # the others: all but the caps
    least = along_curves.get(quantity.name, 0.9)
    assert np.isfinite(values.source).mean() > least
    if not quantity.is_signed:
        assert np.nanmin(values.source) >= 0


def test_the_seam_gap_shown_is_the_one_that_was_reported(results):
    shown = np.nanmax(quantity_named("seam").compute(results, ignore).source)
    assert shown == max(half.gap_um for half in results.registration.halves.values())


def test_the_angles_and_distances_along_the_seam_are_those_of_the_report(results):
    seam = examine_seam(results)
    angles = quantity_named("seam_angle").compute(results, ignore)
    assert np.nanmax(angles.source) == pytest.approx(seam.registered_degrees.largest)
    assert np.nanmax(angles.target) == pytest.approx(seam.target_degrees.largest)
    hole = quantity_named("hole").compute(results, ignore)
    assert np.nanmax(hole.source) == pytest.approx(seam.hole_to_target_um.largest)
    assert np.nanmax(hole.target) == pytest.approx(seam.hole_from_target_um.largest)


def test_the_angle_at_the_seam_is_told_of_both_brains_in_degrees(qtbot, window):
    panel = window.judge
    qtbot.keyClicks(panel.choice, "seam")
    qtbot.keyClick(panel.choice, Qt.Key.Key_Down)
    assert panel.choice.currentText() == "Seam angle"
    qtbot.waitUntil(lambda: window.judging.is_up_to_date)
    for role in ("source", "target"):
        assert panel.histograms[role].isVisibleTo(panel)
        assert re.search(r"mean \d+\.\d+°", panel.numbers[role].text())


def test_the_distance_shown_is_the_one_that_was_measured(results):
    values, measured = quantity_named("distance").compute(results, ignore), results.distances
    for own, surface, distances in (
        (values.source, results.registration.surface, measured.a_to_b),
        (values.target, results.target.surface, measured.b_to_a),
    ):
        areas = surface.vertex_areas
        assert float(own @ areas / areas.sum()) == pytest.approx(distances.mean_um, rel=0.1)
        assert own.max() <= distances.hausdorff_um + 1e-6


def test_an_affine_registration_has_no_displacement_beyond_affine(results):
    from dataclasses import replace

    surface = results.source.surface
    moved = surface.moved(surface.vertices @ np.diag([1.2, 0.9, 1.1]) + [5.0, 0.0, -3.0])
    bent = replace(results, registration=replace(results.registration, surface=moved))
    beyond = quantity_named("beyond_affine").compute(bent, ignore).source
    np.testing.assert_allclose(beyond, 0, atol=1e-8)
    area = judge_by(quantity_named("whole_area"), bent, ignore).summaries["source"]
    assert 0 < area.mean < np.log2(1.2 * 1.1)
    angle = judge_by(quantity_named("whole_angle"), bent, ignore).summaries["source"]
    assert angle.p95 <= np.log2(1.2 / 0.9) + 1e-6


def test_a_choice_colours_the_views_with_a_legend_and_another_takes_it_away(qtbot, window):
    area = window.view_area
    before = colors_in(area.source)
    found = judged(qtbot, window, "beyond_affine")
    for view in (area.source, area.registered):
        np.testing.assert_array_equal(colors_in(view), found.colors["source"])
    scale = window.view_area.frames[0].scale
    assert scale.isVisible()
    assert scale.texts[0] == "0.00 µm"
    assert not window.view_area.frames[1].scale.isVisible()  # the target is not displaced
    assert "mean" in window.judge.numbers["source"].text()
    press(qtbot, window, Qt.Key.Key_O)
    assert window.judging.chosen == ORIGINS
    assert not scale.isVisible()
    press(qtbot, window, Qt.Key.Key_O)
    assert window.judging.chosen == PLAIN
    np.testing.assert_array_equal(colors_in(area.source), before)


def test_values_of_the_source_alone_are_not_tinted_by_the_target(qtbot, window):
    area = window.view_area
    assert area.registered.overlay.actor.prop.opacity > 0
    window.judging.choose("displacement")
    qtbot.waitUntil(lambda: window.judging.is_up_to_date)
    assert area.registered.overlay.actor.prop.opacity == 0
    assert not window.blend.isEnabled()
    window.judging.choose("distance")  # of which the target has values too
    qtbot.waitUntil(lambda: window.judging.is_up_to_date)
    assert area.registered.overlay.actor.prop.opacity == window.blend.value() / 100 > 0
    assert window.blend.isEnabled()


def test_while_a_slider_moves_the_shape_goes_ahead_of_its_colours(qtbot, window):
    open_with_a_pull(qtbot, window)
    found = judged(qtbot, window, "beyond_affine")
    view, slider = window.view_area.registered, window.landmarks.smoothing_slider
    seen = [drawn(view)]

    def shape_follows():
        qtbot.waitUntil(lambda: not np.array_equal(drawn(view), seen[-1]), timeout=LONG_MS)
        seen.append(drawn(view))
        assert window.judging.judged is found

    positions = [slider_position(slider, share) for share in (0.6, 0.9, 1.0)]
    drag(qtbot, slider, positions, shape_follows)
    settle(qtbot, window)
    qtbot.waitUntil(lambda: window.judging.is_up_to_date, timeout=LONG_MS)
    assert window.judging.judged is not found
