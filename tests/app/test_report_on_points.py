"""A report measured on corresponding points, and what it would replace."""

from __future__ import annotations

import json

import numpy as np
import pytest
from flyreg_gui.points_dialog import PointsDialog
from PySide6.QtWidgets import QMessageBox

from flyreg_core.transform import carry
from tests.app.hands import LEFT, LONG_MS, answer_file_dialog, when_asked

pytestmark = pytest.mark.window


def wait_for(qtbot, window, text):
    qtbot.waitUntil(lambda: text in window.statusBar().currentMessage(), timeout=LONG_MS)


def test_points_that_are_named_are_measured_on_page_and_in_json(qtbot, window, tmp_path):
    results = window.session.results
    starts = results.source.surface.vertices[::900] + np.array([0.2, 0.0, 0.0])
    ends = results.registration.surface.vertices[::900] + np.array([0.0, 3.0, 0.0])
    rows = [",".join(map(repr, map(float, row))) for row in np.hstack([starts, ends])]
    header = "x,y,z,x_target,y_target,z_target"
    wrong, right = tmp_path / "wrong.csv", tmp_path / "points.csv"
    wrong.write_text("a,b\n1,2\n")
    right.write_text("\n".join([header, *rows, "9999,0,0,0,0,0"]))
    problems = []

    def name_points(dialog):
        assert not dialog.ok_button.isEnabled()
        qtbot.keyClicks(dialog.chooser.name, str(wrong))
        qtbot.mouseClick(dialog.ok_button, LEFT)
        problems.append(dialog.problem.text())
        dialog.chooser.name.clear()
        qtbot.keyClicks(dialog.chooser.name, str(right))
        answer_file_dialog(tmp_path / "run.html")
        qtbot.mouseClick(dialog.ok_button, LEFT)

    when_asked(PointsDialog, name_points)
    window.actions_by_name["report_on_points"].trigger()
    wait_for(qtbot, window, "Saved")
    assert "has no columns x, y, z, x_target" in problems[0]
    errors = np.linalg.norm(carry(starts, results).points - ends, axis=1)
    told = json.loads((tmp_path / "run.json").read_text())["target_registration_error"]
    assert told == {
        "points": len(starts) + 1,
        "unmapped": 1,
        "mean_um": pytest.approx(errors.mean()),
        "median_um": pytest.approx(np.median(errors)),
        "p95_um": pytest.approx(np.percentile(errors, 95)),
    }
    page = (tmp_path / "run.html").read_text(encoding="utf-8")
    assert f'<data value="{told["mean_um"]}" data-key="target_registration_error.mean_um"' in page


def test_what_a_report_would_replace_is_named_and_kept_unless_the_user_agrees(
    qtbot, window, tmp_path
):
    facts, project = tmp_path / "run.json", tmp_path / "run-project.flyreg"
    facts.write_text("my own")
    project.write_text("my work")
    asked = []

    def refuse(box):
        asked.append(box.informativeText())
        qtbot.mouseClick(box.button(QMessageBox.StandardButton.Cancel), LEFT)

    def agree(box):
        (button,) = [b for b in box.buttons() if b.text() == "Replace"]
        qtbot.mouseClick(button, LEFT)

    answer_file_dialog(tmp_path / "run.html")
    when_asked(QMessageBox, refuse)
    window.actions_by_name["report"].trigger()
    assert asked == ["Replace run.json, run-project.flyreg?"]
    assert (facts.read_text(), project.read_text()) == ("my own", "my work")
    assert not (tmp_path / "run.html").exists()

    answer_file_dialog(tmp_path / "run.html")
    when_asked(QMessageBox, agree)
    window.actions_by_name["report"].trigger()
    wait_for(qtbot, window, "Saved")
    assert json.loads(facts.read_text())["source"]
    assert project.read_text() != "my work"
