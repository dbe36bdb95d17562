"""What is measured at rest stays on show, marked as old, while the hand moves."""

from __future__ import annotations

import pytest
from flyreg_gui.landmark_table import Column
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QStyle, QStyleOptionSlider

from tests.app.hands import LEFT, LONG_MS, drag, open_with_a_pull, settle

pytestmark = pytest.mark.window
NOT_KNOWN = "λ by cross-validation"
LATE_COLUMNS = (Column.FORETOLD, Column.LEVERAGE)


def shown(panel):
    """The texts of the columns that are known at rest, and whether all of them are marked as old."""
    model = panel.model
    cells = [model.index(row, c) for row in range(model.rowCount()) for c in LATE_COLUMNS]
    fonts = [cell.data(Qt.ItemDataRole.FontRole) for cell in cells]
    return [cell.data() for cell in cells], {font is not None and font.italic() for font in fonts}


def handle_of(slider):
    option = QStyleOptionSlider()
    slider.initStyleOption(option)
    part = QStyle.SubControl.SC_SliderHandle
    return slider.style().subControlRect(QStyle.ComplexControl.CC_Slider, option, part, slider)


def test_old_values_stay_greyed_while_lambda_is_dragged_until_the_new_ones_come(qtbot, window):
    open_with_a_pull(qtbot, window)
    panel, session = window.landmarks, window.session
    before, _ = shown(panel)
    curve = panel.curve.grab().toImage()
    assert panel.best_button.text() != NOT_KNOWN
    assert any(before)
    assert not panel.curve.is_late
    start = handle_of(panel.smoothing_slider).center()
    seen = []

    def look():
        results = session.results
        qtbot.waitUntil(lambda: session.results is not results, timeout=LONG_MS)
        seen.append((*shown(panel), panel.curve.is_late, panel.best_button.text()))

    drag(
        qtbot,
        panel.smoothing_slider,
        [start, start + QPoint(25, 0), start + QPoint(40, 0)],
        look,
    )
    for texts, are_old, is_late, text in seen:
        assert texts == before
        assert are_old == {True}
        assert is_late
        assert text != NOT_KNOWN  # the curve that was found at rest holds for every λ
    assert not panel.best_button.isEnabled() or session.is_complete
    settle(qtbot, window)
    after, are_old = shown(panel)
    assert are_old == {False}
    assert after != before
    assert not panel.curve.is_late
    assert panel.curve.grab().toImage() != curve
    advice = session.results.judgement.cross_validation.advise(session.project.smoothing)
    assert panel.best_button.isEnabled() == (advice.smoothing is not None)


def test_another_project_begins_with_nothing_old(qtbot, window, project):
    window.session.open(project)
    assert not window.landmarks.curve.is_late
    assert window.landmarks.best_button.text() == NOT_KNOWN
    assert set(shown(window.landmarks)[0]) <= {""}
    settle(qtbot, window)
    qtbot.mouseClick(window.landmarks.best_button, LEFT)
    settle(qtbot, window)
