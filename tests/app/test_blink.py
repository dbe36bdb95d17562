"""Two states of weights and lambda, kept as A and B."""

from __future__ import annotations

import numpy as np
import pytest

from flyreg_core import edits
from flyreg_core.project_file import load_project, save_project

pytest.importorskip("PySide6")
from PySide6.QtCore import Qt

from tests.app.hands import CONTROL, LONG_MS, drawn, press, pulling_aside, settle

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]

SHIFT, ALT = Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.AltModifier


def test_a_and_b_are_kept_shown_in_turn_and_taken_again(qtbot, window, tmp_path):
    session, view = window.session, window.view_area.registered
    pictures = {}
    mine = pulling_aside(session.results, session.results.landmarks[-1].source_point)
    session.edit("add", edits.add_pair(session.project, mine))  # which λ gives way to or not
    settle(qtbot, window)
    assert not window.actions_by_name["blink"].isEnabled()
    for name, key, smoothing in (("A", Qt.Key.Key_A, 1e-4), ("B", Qt.Key.Key_B, 1.0)):
        session.edit("smooth", edits.set_smoothing(session.project, smoothing))
        press(qtbot, window, key, CONTROL | SHIFT)
        qtbot.waitUntil(lambda: session.is_up_to_date, timeout=LONG_MS)
        pictures[name] = drawn(view)
    session.edit("smooth", edits.set_smoothing(session.project, 0.05))
    settle(qtbot, window)
    own, project, steps = drawn(view), session.project, session.undo_stack.count()
    assert not np.allclose(pictures["A"], pictures["B"], atol=0.1)

    press(qtbot, window, Qt.Key.Key_B)
    for name in ("A", "B", "A"):
        qtbot.waitUntil(lambda name=name: session.beside == name, timeout=LONG_MS)
        np.testing.assert_allclose(drawn(view), pictures[name], atol=1e-3)
        assert window.status.state.text() == f"{name} on show"
        assert not window.actions_by_name["export"].isEnabled()
    assert session.project is project
    assert session.undo_stack.count() == steps
    press(qtbot, window, Qt.Key.Key_Escape)
    np.testing.assert_array_equal(drawn(view), own)
    assert not window.actions_by_name["blink"].isChecked()

    window.blink.set_on(True)  # at once, as both are known
    assert session.beside == "A"
    press(qtbot, window, Qt.Key.Key_A, CONTROL | ALT)  # an edit ends it
    assert session.beside == ""
    settle(qtbot, window)
    assert session.project.smoothing == 1e-4
    last_bit = np.finfo(np.float32).eps  # what is equal but for 1e-12 may round either way
    np.testing.assert_allclose(drawn(view), pictures["A"], rtol=last_bit, atol=1e-6)
    press(qtbot, window, Qt.Key.Key_Z, CONTROL)
    assert session.project is project
    save_project(project, tmp_path / "p.flyreg")
    assert load_project(tmp_path / "p.flyreg").snapshots == project.snapshots
    settle(qtbot, window)
