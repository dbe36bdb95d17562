"""Landmarks in the colours of their residual, left-out error or weight: the same in all views."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from flyreg_gui.landmark_table import Column
from flyreg_gui.marker_colors import FORETOLD, LEVERAGE, MOST_FACTOR, OWN, RESIDUAL, ROBUST, WEIGHT
from flyreg_gui.theme import OFF
from flyreg_gui.view_state import view_state
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMenu

from flyreg_core.color_maps import BLUE_BROWN, VIRIDIS
from tests.app.hands import settle

pytestmark = pytest.mark.window


def choose(window, title):
    menu = window.findChild(QMenu, "Colour landmarks by")
    (action,) = [action for action in menu.actions() if action.text() == title]
    action.trigger()


def drawn_colors(window):
    """The colours that each view draws, by id of the landmark."""
    area = window.view_area
    for view in area.surface_views:
        colors = np.array(view._markers._polydata.point_data["color"])
        yield dict(zip(view._ids, map(tuple, colors.tolist()), strict=True))
    for view in area.flat_views:
        colors = np.array(view._markers._polydata.point_data["color"])
        yield dict(zip(view._ids, map(tuple, colors.tolist()), strict=True))


def table_colors(window):
    model = window.landmarks.model
    cells = [model.index(row, Column.NAME) for row in range(model.rowCount())]
    return [cell.data(Qt.ItemDataRole.DecorationRole).getRgb()[:3] for cell in cells]


@pytest.mark.parametrize(
    ("title", "name", "unit"),
    [
        ("Residual", RESIDUAL, "µm"),
        ("Left-out error", FORETOLD, "µm"),
        ("Leverage", LEVERAGE, "%"),
    ],
)
def test_landmarks_have_the_colour_of_their_error_in_all_views_and_in_the_table(
    window, title, name, unit
):
    results = window.session.results
    errors = {
        RESIDUAL: results.registration.residual_um,
        FORETOLD: results.judgement.leave_one_out_um,
        LEVERAGE: {key: 100 * share for key, share in results.judgement.leverage.items()},
    }[name]
    finite = {key: value for key, value in errors.items() if np.isfinite(value)}
    choose(window, title)
    high = max(float(np.percentile(list(finite.values()), ROBUST)), 0.1)
    expected = {
        key: tuple(VIRIDIS(np.array([value / high]))[0].tolist()) for key, value in finite.items()
    }
    for colors in drawn_colors(window):
        assert colors
        for key, color in colors.items():
            assert color == expected.get(key, OFF)
    ids = window.landmarks.model.ids
    assert table_colors(window) == [expected.get(key, OFF) for key in ids]
    scales = [frame.marker_scale for frame in window.view_area.frames]
    assert [scale.isVisible() for scale in scales] == [True, False, False, False, False]
    assert scales[0].texts[0] == f"0.00 {unit}"
    assert scales[0].texts[-1].endswith(f" {unit}")
    assert float(scales[0].texts[-1].split()[0]) == pytest.approx(high, rel=0.05)


def test_weights_are_blue_below_one_brown_above_and_grey_at_zero(qtbot, window):
    ids = window.landmarks.model.ids[:3]
    weights = dict(zip(ids, (0.25, 4.0, 0.0), strict=True))
    choose(window, "Weight")
    window.session.edit("weights", replace(window.session.project, weights=weights))
    settle(qtbot, window)
    acting = [mark for mark in window.session.results.landmarks if mark.weight > 0]
    most = min(max(abs(np.log2(mark.weight)) for mark in acting), np.log2(MOST_FACTOR))
    shares = {mark.pair.id: (np.log2(mark.weight) / most + 1) / 2 for mark in acting}
    assert shares[ids[0]] < 0.5 < shares[ids[1]]
    colors = next(drawn_colors(window))
    assert colors[ids[2]] == OFF
    for name, share in shares.items():
        assert colors[name] == tuple(BLUE_BROWN(np.array([share]))[0].tolist())
    low, middle, high = window.view_area.frames[0].marker_scale.texts
    assert middle == "×1.00"
    assert float(low[1:]) * float(high[1:]) == pytest.approx(1, rel=0.1)


def test_the_choice_is_the_same_in_menu_and_panel_and_kept_with_the_project(window):
    before = list(drawn_colors(window))
    choose(window, "Weight")
    panel = window.judge.marker_choice
    assert panel.currentText() == "Weight"
    assert view_state(window)["marker_colors"] == WEIGHT
    panel.setCurrentIndex(0)
    panel.activated.emit(0)
    assert window.coloring.chosen == OWN
    assert list(drawn_colors(window)) == before
    assert not any(frame.marker_scale.isVisible() for frame in window.view_area.frames)
    menu = window.findChild(QMenu, "Colour landmarks by")
    assert [action.text() for action in menu.actions() if action.isChecked()] == [panel.itemText(0)]
