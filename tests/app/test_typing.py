"""Letters mean what has the keyboard: a list is searched, and only the views know shortcuts."""

from __future__ import annotations

import pytest

pytest.importorskip("PySide6")
from flyreg_gui.landmark_table import Column
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from tests.app.hands import LEFT, activate

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]


def type_key(qtbot, window, key):
    """Press a key where the keyboard is, as the system would."""
    activate(qtbot, window)
    QTest.keyClick(QApplication.focusWidget(), key)


def name_of_current(table):
    return table.currentIndex().siblingAtColumn(Column.NAME).data()


def test_a_letter_in_the_table_goes_to_the_landmark_of_that_name_and_does_nothing_else(
    qtbot, window
):
    table, project, actions = window.landmarks.table, window.session.project, window.actions_by_name
    cell = table.visualRect(table.model().index(2, Column.RESIDUAL)).center()
    qtbot.mouseClick(table.viewport(), LEFT, pos=cell)
    assert QApplication.focusWidget() is table
    for key in (Qt.Key.Key_S, Qt.Key.Key_U, Qt.Key.Key_V, Qt.Key.Key_M, Qt.Key.Key_3):
        type_key(qtbot, window, key)
        QTest.qWait(QApplication.keyboardInputInterval() + 50)
    type_key(qtbot, window, Qt.Key.Key_H)
    assert name_of_current(table).startswith("hole")
    assert window.session.project is project
    assert actions["markers"].isChecked()
    assert "“h”" in window.status.currentMessage()


def test_escape_gives_the_letters_back_to_the_window(qtbot, window):
    table, markers = window.landmarks.table, window.actions_by_name["markers"]
    table.setFocus()
    type_key(qtbot, window, Qt.Key.Key_Escape)
    assert QApplication.focusWidget() is not table
    type_key(qtbot, window, Qt.Key.Key_V)
    assert not markers.isChecked()


def test_space_is_the_landmark_mode_also_while_the_table_has_the_keyboard(qtbot, window):
    window.landmarks.table.setFocus()
    type_key(qtbot, window, Qt.Key.Key_Space)
    assert window.mode.is_on


def test_a_letter_in_a_list_to_choose_from_chooses_there(qtbot, window):
    window.actions_by_name["tunnels"].trigger()
    for widget in (window.landmarks.neighbourhood.place, window.steps.tunnels.list):
        widget.setFocus()
        assert QApplication.focusWidget() is widget
        type_key(qtbot, window, Qt.Key.Key_L)
        type_key(qtbot, window, Qt.Key.Key_V)
        assert window.actions_by_name["markers"].isChecked()
