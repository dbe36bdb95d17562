"""Keys mean the same wherever the user clicked last; only fields to type in take letters."""

from __future__ import annotations

import pytest

pytest.importorskip("PySide6")
from flyreg_gui.landmark_table import Column
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit

from flyreg_core import edits
from flyreg_core.landmarks import LandmarkPair
from tests.app.hands import LEFT, activate, settle

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]


def type_key(qtbot, window, key):
    """Press a key where the keyboard is, as the system would."""
    activate(qtbot, window)
    QTest.keyClick(QApplication.focusWidget(), key)


def cell(window, identifier, column):
    """The middle of a landmark's cell in the table."""
    table = window.landmarks.table
    row = window.landmarks.model.ids.index(identifier)
    index = table.model().mapFromSource(window.landmarks.model.index(row, column))
    table.scrollTo(index)
    return table.visualRect(index).center()


def click_on(qtbot, window, identifier, column=Column.RESIDUAL):
    """Select a landmark by a click on its row."""
    place = cell(window, identifier, column)
    qtbot.mouseClick(window.landmarks.table.viewport(), LEFT, pos=place)
    assert QApplication.focusWidget() is window.landmarks.table


def own_pair(qtbot, window):
    """Add a landmark of the user's own; return its id."""
    places = [
        tuple(brain.surface.vertices[brain.surface.vertices[:, 0].argmax()].tolist())
        for brain in (window.session.results.source, window.session.results.target)
    ]
    mine = LandmarkPair("mine", "mine", "interior", None, *places)
    window.session.edit("add mine", edits.add_pair(window.session.project, mine))
    settle(qtbot, window)
    return mine.id


def test_after_a_click_in_the_table_the_keys_of_landmarks_act_on_that_landmark(qtbot, window):
    session, actions = window.session, window.actions_by_name
    click_on(qtbot, window, "upper-02")
    type_key(qtbot, window, Qt.Key.Key_U)
    assert session.project.is_muted("upper-02")
    type_key(qtbot, window, Qt.Key.Key_U)
    assert not session.project.is_muted("upper-02")
    type_key(qtbot, window, Qt.Key.Key_S)
    assert list(session.project.solo) == ["upper-02"]
    type_key(qtbot, window, Qt.Key.Key_S)
    assert not session.project.solo
    before = window.view_area.source.pose()
    type_key(qtbot, window, Qt.Key.Key_G)
    assert window.view_area.source.pose() != before
    type_key(qtbot, window, Qt.Key.Key_V)
    assert not actions["markers"].isChecked()
    mine = own_pair(qtbot, window)
    click_on(qtbot, window, mine)
    type_key(qtbot, window, Qt.Key.Key_M)
    assert len(session.project.pairs) == 2


def test_a_letter_that_is_no_key_leaves_the_selection_as_it_is(qtbot, window):
    click_on(qtbot, window, "upper-02")
    type_key(qtbot, window, Qt.Key.Key_H)  # landmarks of the hole begin with it
    assert window.selection.ids == ("upper-02",)


def test_a_name_is_typed_into_its_cell_letter_by_letter(qtbot, window):
    mine = own_pair(qtbot, window)
    table, project = window.landmarks.table, window.session.project
    place = cell(window, mine, Column.NAME) + QPoint(10, 0)
    qtbot.mouseClick(table.viewport(), LEFT, pos=place)
    qtbot.mouseDClick(table.viewport(), LEFT, pos=place)
    editor = QApplication.focusWidget()
    assert isinstance(editor, QLineEdit)
    for key in (Qt.Key.Key_S, Qt.Key.Key_U, Qt.Key.Key_Space, Qt.Key.Key_G, Qt.Key.Key_3):
        type_key(qtbot, window, key)
    assert window.session.project is project
    assert not window.mode.is_on
    type_key(qtbot, window, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: window.session.project.pairs[-1].name == "su g3")


def test_escape_gives_the_letters_back_to_the_window(qtbot, window):
    choice, markers = window.landmarks.neighbourhood.place, window.actions_by_name["markers"]
    choice.setFocus()
    type_key(qtbot, window, Qt.Key.Key_V)
    assert markers.isChecked()
    type_key(qtbot, window, Qt.Key.Key_Escape)
    assert QApplication.focusWidget() is not choice
    type_key(qtbot, window, Qt.Key.Key_V)
    assert not markers.isChecked()


def test_a_choice_made_by_the_mouse_leaves_the_keys_to_the_window(qtbot, window):
    window.docks[3].raise_()
    choice = window.judge.choice
    qtbot.waitUntil(choice.isVisible)
    qtbot.mouseClick(choice, LEFT)
    QTest.keyClick(QApplication.activePopupWidget(), Qt.Key.Key_Escape)
    type_key(qtbot, window, Qt.Key.Key_V)
    assert not window.actions_by_name["markers"].isChecked()


def test_space_is_the_landmark_mode_also_while_the_table_has_the_keyboard(qtbot, window):
    window.landmarks.table.setFocus()
    type_key(qtbot, window, Qt.Key.Key_Space)
    assert window.mode.is_on
