"""Comparing flyreg with other methods from the window."""

from __future__ import annotations

import json
from dataclasses import replace

import psutil
import pytest
from flyreg_gui.comparison_dialog import ComparisonDialog
from flyreg_gui.comparison_table import COLUMNS
from PySide6.QtCore import QObject, QPoint, QTimer, QUrl, Slot
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QApplication, QFileDialog, QLineEdit, QMessageBox

from flyreg_core.brain_files import open_brain, read_brain
from flyreg_core.comparison import METHODS, TITLES
from flyreg_core.report_page import looked_up
from flyreg_core.rivals.table import RIVAL_OF
from tests.app.hands import LEFT, LONG_MS

pytestmark = pytest.mark.window


@pytest.fixture
def dialog(qtbot, window):
    window.actions_by_name["compare"].trigger()
    (found,) = window.findChildren(ComparisonDialog)
    qtbot.waitExposed(found)
    yield found
    if found in window.findChildren(ComparisonDialog):
        found.close()


@pytest.fixture
def truth(demo_files, tmp_path):
    """Some corresponding vertices of the demo pair; the last ones are far from both brains."""
    source, target = (read_brain(open_brain(str(path), "um")).vertices for path in demo_files)
    rows = [
        [*source[k], *target[k]]
        for k in range(0, len(source), len(source) // 100)
        if abs(source[k, 0] - source[:, 0].mean()) < 80
    ]
    path = tmp_path / "truth.csv"
    lines = [",".join(map(repr, map(float, row))) for row in [*rows, [5000.0] * 6]]
    path.write_text("\n".join(["x,y,z,x_target,y_target,z_target", *lines]))
    return path


class Opened(QObject):
    """Takes the addresses that the program asks the desktop to open."""

    def __init__(self):
        super().__init__()
        self.urls = []

    @Slot(QUrl)
    def take(self, url):
        self.urls.append(url)


@pytest.fixture
def opened():
    taker = Opened()
    QDesktopServices.setUrlHandler("file", taker, "take")
    yield taker.urls
    QDesktopServices.unsetUrlHandler("file")


def tick_only(qtbot, dialog, wanted):
    """Click the boxes of all methods that are not as they should be."""
    for row, name in enumerate(METHODS):
        if (name in dialog.table.ticked) != (name in wanted):
            place = dialog.table.visualItemRect(dialog.table.item(row, 0))
            qtbot.mouseClick(
                dialog.table.viewport(), LEFT, pos=QPoint(place.left() + 11, place.center().y())
            )
    assert set(dialog.table.ticked) == set(wanted)


def workers():
    own = psutil.Process().children()
    return [process for process in own if "flyreg_core.apart" in process.cmdline()]


def answer_folder(path):
    """Choose a folder in the next file dialog."""

    def take():
        box = QApplication.activeModalWidget()
        if isinstance(box, QFileDialog):
            box.findChild(QLineEdit, "fileNameEdit").setText(str(path))
            box.accept()
        else:
            QTimer.singleShot(20, take)

    QTimer.singleShot(20, take)


def test_methods_have_titles_and_errors_on_points_have_columns_only_where_there_are_points(
    qtbot, dialog
):
    table = dialog.table
    titles = [table.item(row, 0).text() for row in range(table.rowCount())]
    assert titles == [TITLES[name] for name in METHODS]
    errors = [n for n, column in enumerate(COLUMNS, 1) if column[0].startswith("TRE")]
    assert all(table.isColumnHidden(number) for number in errors)
    qtbot.keyClicks(dialog.points.name, "points.csv")
    assert not any(table.isColumnHidden(number) for number in errors)
    dialog.points.name.clear()
    assert all(table.isColumnHidden(number) for number in errors)


def test_rows_appear_as_methods_end_and_are_saved_as_the_command_writes_them(
    qtbot, dialog, truth, tmp_path, opened
):
    tick_only(qtbot, dialog, ("none", "alignment", "flyreg"))
    qtbot.keyClicks(dialog.points.name, str(truth))
    assert not dialog.save_button.isEnabled()
    qtbot.mouseClick(dialog.start_button, LEFT)
    assert dialog.table.text("none", "Mean") == "waiting…"
    qtbot.waitUntil(lambda: dialog.table.text("flyreg", "TRE") != "", timeout=LONG_MS)
    assert dialog.cancel_button.isVisible()
    qtbot.waitUntil(lambda: dialog.answer is not None, timeout=LONG_MS)
    assert dialog.pictures.count() == 4
    assert "1 points are too far" in dialog.note.text()
    assert float(dialog.table.text("none", "TRE")) > float(dialog.table.text("flyreg", "TRE"))

    folder = tmp_path / "comparison"
    folder.mkdir()
    answer_folder(folder)
    qtbot.mouseClick(dialog.save_button, LEFT)
    qtbot.waitUntil(dialog.page_button.isEnabled, timeout=LONG_MS)
    methods = ("none", "alignment", "flyreg")
    assert {path.name for path in folder.iterdir()} == {
        *(f"{name}.{kind}" for name in methods for kind in ("ply", "png")),
        *("target.png", "compare.png", "compare.json", "compare.csv", "compare.html"),
    }
    for row in json.loads((folder / "compare.json").read_text())["rows"]:
        for header, key, factor, digits, _ in COLUMNS:
            shown = f"{factor * looked_up(row, key):.{digits}f}"
            assert dialog.table.text(row["method"], header) == shown
    qtbot.mouseClick(dialog.page_button, LEFT)
    assert [url.toLocalFile() for url in opened] == [str(folder / "compare.html")]


def test_what_was_ready_when_it_was_cancelled_can_be_saved_as_incomplete(qtbot, dialog, tmp_path):
    tick_only(qtbot, dialog, ("none", "cpd-nonrigid"))
    qtbot.mouseClick(dialog.start_button, LEFT)
    qtbot.waitUntil(lambda: dialog.table.text("none", "RMS") != "", timeout=LONG_MS)
    qtbot.mouseClick(dialog.cancel_button, LEFT)
    qtbot.waitUntil(lambda: "Cancelled" in dialog.note.text(), timeout=LONG_MS)
    assert workers() == []
    assert dialog.table.text("cpd-nonrigid", "Mean") == "cancelled"
    answer_folder(tmp_path)
    qtbot.mouseClick(dialog.save_button, LEFT)
    qtbot.waitUntil(dialog.page_button.isEnabled, timeout=LONG_MS)
    facts = json.loads((tmp_path / "compare.json").read_text())
    assert not facts["is_complete"]
    assert [row["status"] for row in facts["rows"]] == ["done", "cancelled"]
    assert "cancelled after 1 of 2 methods" in (tmp_path / "compare.html").read_text()


def test_cancelling_ends_the_processes(qtbot, dialog):
    qtbot.mouseClick(dialog.start_button, LEFT)
    qtbot.waitUntil(lambda: workers() != [], timeout=LONG_MS)
    running = workers()
    qtbot.mouseClick(dialog.cancel_button, LEFT)
    qtbot.waitUntil(lambda: "Cancelled" in dialog.note.text(), timeout=LONG_MS)
    assert not any(process.is_running() for process in running)
    assert dialog.table.text("flyreg", "Mean") == "cancelled"
    assert dialog.start_button.isEnabled()


def test_closing_the_window_ends_a_comparison(qtbot, window, dialog):
    qtbot.mouseClick(dialog.start_button, LEFT)
    qtbot.waitUntil(lambda: workers() != [], timeout=LONG_MS)
    running = workers()
    window.session.undo_stack.setClean()
    assert window.close()
    assert not any(process.is_running() for process in running)


def test_a_method_whose_package_is_missing_says_why_and_cannot_be_ticked(
    qtbot, window, monkeypatch
):
    lacking = replace(RIVAL_OF["ndt"], package="no_such_package")
    monkeypatch.setitem(RIVAL_OF, "ndt", lacking)
    window.actions_by_name["compare"].trigger()
    (dialog,) = window.findChildren(ComparisonDialog)
    assert "ndt" not in dialog.table.ticked
    assert dialog.table.text("ndt", "Mean").startswith("needs the package no_such_package")
    place = dialog.table.visualItemRect(dialog.table.item(METHODS.index("ndt"), 0))
    qtbot.mouseClick(
        dialog.table.viewport(), LEFT, pos=QPoint(place.left() + 11, place.center().y())
    )
    assert "ndt" not in dialog.table.ticked
    dialog.close()


def test_points_that_cannot_be_read_are_a_sentence(qtbot, dialog, tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("x,y,z\n1,2,3\n")
    qtbot.keyClicks(dialog.points.name, str(path))
    qtbot.mouseClick(dialog.start_button, LEFT)
    qtbot.waitUntil(lambda: "has no columns x, y, z, x_target" in dialog.note.text())
    assert dialog.table.text("none", "Mean") == "nothing is moved"
    assert workers() == []


def test_files_that_would_be_replaced_are_named(qtbot, dialog, tmp_path):
    from flyreg_gui.dialogs import may_replace

    (tmp_path / "compare.json").write_text("mine")
    asked = []

    def refuse():
        box = QApplication.activeModalWidget()
        asked.append(f"{box.text()} {box.informativeText()}")
        qtbot.mouseClick(box.button(QMessageBox.StandardButton.Cancel), LEFT)

    QTimer.singleShot(100, refuse)
    assert not may_replace(dialog, [tmp_path / "compare.json", tmp_path / "new.csv"])
    assert "compare.json" in asked[0]
    assert "new.csv" not in asked[0]
    assert may_replace(dialog, [tmp_path / "new.csv"])
