"""Saving the report from the window."""

from __future__ import annotations

import json

import pytest
from flyreg_gui.work import Work
from PySide6.QtWidgets import QApplication, QProgressDialog, QPushButton

from flyreg_core.project_file import load_project
from tests.app.hands import LONG_MS, answer_file_dialog

pytestmark = pytest.mark.window


def save_report(window, path):
    answer_file_dialog(path)
    window.actions_by_name["report"].trigger()


def test_the_report_of_what_is_on_show_is_written_beside_the_project_that_repeats_it(
    qtbot, window, tmp_path
):
    save_report(window, tmp_path / "my run.html")
    project = tmp_path / "my run-project.flyreg"
    qtbot.waitUntil(
        lambda: window.statusBar().currentMessage().startswith("Saved"), timeout=LONG_MS
    )
    page = (tmp_path / "my run.html").read_text(encoding="utf-8")
    facts = json.loads((tmp_path / "my run.json").read_text())
    assert "--project 'my run-project.flyreg'" in page.replace("&#39;", "'")
    mean = window.session.results.distances.a_to_b.mean_um
    assert facts["distance"]["source_to_target"]["mean_um"] == mean
    assert f'value="{mean}"' in page
    assert load_project(project) == window.session.results.project


def test_a_report_can_be_cancelled_and_leaves_no_file(qtbot, window, tmp_path):
    path = tmp_path / "report.html"
    save_report(window, path)
    progress = window.findChild(QProgressDialog)
    progress.findChild(QPushButton).click()
    qtbot.waitUntil(lambda: "not saved" in window.statusBar().currentMessage(), timeout=LONG_MS)
    assert list(tmp_path.glob("report*")) == []
    assert window.actions_by_name["report"].isEnabled()


def test_a_place_where_nothing_can_be_written_is_said(qtbot, window, tmp_path):
    (tmp_path / "report.json").mkdir()
    save_report(window, tmp_path / "report.html")
    qtbot.waitUntil(lambda: "report.json cannot be written" in window.banner.text, timeout=LONG_MS)
    assert QApplication.activeModalWidget() is None


def test_closing_the_window_ends_a_report_that_is_being_written(qtbot, window, tmp_path):
    save_report(window, tmp_path / "report.html")
    window.session.undo_stack.setClean()
    assert window.close()
    assert not (tmp_path / "report.html").exists()


def test_without_measured_results_there_is_no_report(empty_window):
    assert not empty_window.actions_by_name["report"].isEnabled()


def test_work_ends_with_what_became_of_it(qtbot):
    def fail(report):
        raise ValueError("no")

    for task, signal, expected in ((lambda report: 7, "finished", 7), (fail, "failed", "no")):
        work = Work(task)
        with qtbot.waitSignal(getattr(work, signal)) as blocker:
            work.start()
        assert str(blocker.args[0]) == str(expected)
        work.close()
