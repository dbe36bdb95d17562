"""The curves of what simplifying and smoothing cost, opened from the settings."""

from __future__ import annotations

import pytest
from flyreg_gui.curves_dialog import CurvesDialog

from tests.app.hands import LEFT, LONG_MS

pytestmark = pytest.mark.window


@pytest.fixture
def dialog(qtbot, window):
    qtbot.mouseClick(window.steps.settings_button, LEFT)
    qtbot.waitUntil(window.steps.form.curves_button.isVisible)
    qtbot.mouseClick(window.steps.form.curves_button, LEFT)
    (found,) = window.findChildren(CurvesDialog)
    qtbot.waitExposed(found)
    yield found
    if found in window.findChildren(CurvesDialog):
        found.close()


def test_the_curves_of_the_source_are_measured_and_drawn(qtbot, dialog, results):
    qtbot.waitUntil(lambda: not dialog.bar.isVisible(), timeout=LONG_MS)
    assert dialog.picture.renderer().isValid()
    assert "Recommended for simplification: area within 1%" in dialog.reasons.text()
    name = results.source.brain.input.name
    assert dialog.brain.currentText() == f"Source: {name}"
    picture = dialog.picture.grab().toImage()
    colors = {picture.pixelColor(x, y).name() for x in range(0, 900, 3) for y in range(0, 400, 3)}
    assert len(colors) > 5


def test_measuring_can_be_cancelled_and_taken_up_again(qtbot, dialog):
    qtbot.mouseClick(dialog.cancel_button, LEFT)
    qtbot.waitUntil(lambda: "Cancelled" in dialog.reasons.text(), timeout=LONG_MS)
    assert not dialog.bar.isVisible()
    dialog.brain.setCurrentIndex(1)
    assert dialog.bar.isVisible()


def test_closing_the_dialog_ends_the_work(qtbot, window, dialog):
    qtbot.mouseClick(dialog.close_button, LEFT)
    qtbot.waitUntil(lambda: not window.findChildren(CurvesDialog))
