"""Landmarks that fold the surface are named at once, with remedies that are one edit each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("PySide6")
from flyreg_gui.judging import PLAIN, STATUS, STATUS_COLORS
from PySide6.QtCore import Qt

from flyreg_core.edits import add_pair, set_smoothing
from flyreg_core.landmarks import LandmarkPair
from flyreg_core.vertex_quantities import STATUS_NAMES
from tests.app.hands import CONTROL, LEFT, press, settle

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]


@pytest.fixture
def crossed(qtbot, window):
    """A window in which two strong landmarks of the user's have changed places."""
    results = window.session.results
    near = [m for m in results.landmarks if m.pair.kind == "interior" and "anterior" in m.plane]
    places = np.array([m.plane["anterior"][0] for m in near])
    away = np.linalg.norm(places[:, None] - places, axis=-1) + 10 * np.eye(len(near))
    first, second = divmod(int(away.argmin()), len(near))
    project = set_smoothing(window.session.project, 0.0)
    for name, start, end in (("one", first, second), ("other", second, first)):
        ends = (near[start].source_point, near[end].target_point)
        pair = LandmarkPair(name, name, "interior", None, *(tuple(map(float, e)) for e in ends))
        project = add_pair(project, replace(pair, weight=5.0))
    off = {near[index].pair.id: 0.0 for index in (first, second)}
    window.session.edit("cross", replace(project, weights={**project.weights, **off}))
    settle(qtbot, window)
    return window


def test_folds_are_announced_with_who_makes_them_and_each_remedy_is_one_edit(
    qtbot, crossed, results
):
    window, alarm = crossed, crossed.fold_alarm
    assert alarm.isVisible()
    halves = window.session.results.registration.halves.values()
    mended = sum(half.folds_mended for half in halves)
    assert mended > 0
    assert f"{mended:,} triangle" in alarm.text
    assert alarm.folds.culprits[0].name in alarm.text
    assert alarm.folds.culprits[0].id in ("one", "other")
    assert f"({mended} mended)" in window.status.folds.text()

    project, count = window.session.project, window.session.undo_stack.count()
    worst = alarm.folds.culprits[0]
    qtbot.mouseClick(alarm.weaken_button, LEFT)
    weights = {pair.id: pair.weight for pair in window.session.project.pairs}
    weight = {**window.session.project.weights, **weights}[worst.id]
    assert weight == pytest.approx(worst.weight / 4)
    assert window.session.undo_stack.count() == count + 1
    press(qtbot, window, Qt.Key.Key_Z, CONTROL)
    assert window.session.project == project
    settle(qtbot, window)
    qtbot.mouseClick(alarm.smooth_button, LEFT)
    assert window.session.project.smoothing > project.smoothing
    press(qtbot, window, Qt.Key.Key_Z, CONTROL)
    settle(qtbot, window)
    qtbot.mouseClick(alarm.close_button, LEFT)
    assert alarm.text == ""
    window.session.run_again()
    settle(qtbot, window)
    assert alarm.text == ""
    press(qtbot, window, Qt.Key.Key_Z, CONTROL)  # the crossing itself
    settle(qtbot, window)
    at_rest = results.registration.halves.values()
    assert alarm.folds.mended == sum(half.folds_mended for half in at_rest)


def test_a_wrong_click_that_folds_the_surface_is_named_wherever_it_folds(qtbot, window):
    inner = [m for m in window.session.results.landmarks if m.pair.kind == "interior"]
    marks = [mark for mark in inner if "anterior" in mark.plane]
    points = np.array([mark.target_point for mark in marks])
    start, end = divmod(int(np.linalg.norm(points[:, None] - points, axis=2).argmax()), len(marks))
    ends = (marks[start].source_point, marks[end].target_point)
    places = (tuple(map(float, place)) for place in ends)
    wrong = LandmarkPair("wrong", "wrong click", "interior", None, *places, weight=50.0)
    window.session.edit("click", add_pair(window.session.project, wrong))
    settle(qtbot, window)
    alarm = window.fold_alarm
    assert alarm.isVisible()
    qtbot.mouseClick(alarm.places_button, LEFT)  # colours tell where
    assert window.judging.chosen == STATUS
    qtbot.waitUntil(lambda: window.judging.is_up_to_date)
    mended = STATUS_COLORS[STATUS_NAMES.index("fold mended")]
    assert (window.judging.judged.colors["source"] == mended).all(axis=1).any()
    assert not window.view_area.frames[0].legend.isHidden()
    qtbot.mouseClick(alarm.places_button, LEFT)
    assert window.judging.chosen == PLAIN
    away = window.session.results.judgement.leave_one_out_um["wrong"]
    assert f"“wrong click” stands out: the other landmarks would put it {away:.0f} µm" in alarm.text
    qtbot.mouseClick(alarm.weaken_button, LEFT)
    assert window.session.project.pairs[-1].weight == pytest.approx(50.0 / 4)


def test_the_status_bar_tells_exact_from_preview(qtbot, window):
    status = window.status
    assert status.state.text().startswith("exact")
    assert status.foretold.text().startswith("leave-one-out ")
    assert status.gap.text().startswith("seam ")
    window.session.begin_gesture()
    window.session.edit("λ", set_smoothing(window.session.project, 0.5))
    assert status.state.text().startswith("updating…")
    qtbot.waitUntil(lambda: window.session.is_up_to_date)
    assert status.state.text().startswith("preview")
    assert status.distance.text() == "distance …"
    window.session.end_gesture()
    settle(qtbot, window)
    assert status.state.text().startswith("exact")
