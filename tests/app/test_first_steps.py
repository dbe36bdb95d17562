"""What somebody meets who opens the program for the first time, also without a mouse or a screen."""

from __future__ import annotations

import pytest

pytest.importorskip("PySide6")
from flyreg_gui import template_browser, thumbnails
from flyreg_gui.curves_dialog import CurvesDialog
from flyreg_gui.dialogs import OpenBrainsDialog, VoxelSizeDialog
from flyreg_gui.help_window import MOUSE_AND_KEYS, PAGES, HelpWindow, help_pages
from flyreg_gui.preferences import Preferences
from flyreg_gui.preferences_dialog import PreferencesDialog
from flyreg_gui.template_browser import TemplateBrowser
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtGui import QAccessible
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QAbstractSlider,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QDockWidget,
    QHeaderView,
    QLineEdit,
    QProgressBar,
    QScrollBar,
    QTabBar,
    QTextBrowser,
    QToolBar,
    QWidget,
)

from flyreg_core import templates
from flyreg_core.cache import FOLDER_VARIABLE
from tests.app.hands import LEFT, activate, press, settle

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]

needs_templates = pytest.mark.skipif(not templates.is_installed(), reason="flybrains is missing")


# The tour


def in_window(window, widget):
    return QRect(widget.mapTo(window, QPoint(0, 0)), widget.size())


def test_the_tour_points_at_one_part_after_the_other_and_ends(qtbot, window):
    tour = window.tour
    window.actions_by_name["tour"].trigger()
    assert Preferences().has_toured
    places, titles = [], []
    while tour.number is not None:
        assert tour.number == len(places)
        assert tour.bubble.isVisible()
        assert window.rect().contains(in_window(window, tour.bubble))
        assert tour._text.height() >= tour._text.heightForWidth(tour._text.width())
        places.append((tour.ring.x(), tour.ring.y()))
        titles.append(tour._title.text())
        qtbot.mouseClick(tour.next_button, LEFT)
    assert not tour.bubble.isVisible()
    assert len(set(places)) == len(set(titles)) == 6


def test_the_tour_stays_at_its_target_and_can_be_gone_back_and_ended(qtbot, window):
    tour = window.tour
    tour.start()
    window.resize(1200, 800)
    QApplication.processEvents()
    target = in_window(window, window.steps.open_button)
    assert in_window(window, tour.ring).contains(target)
    qtbot.mouseClick(tour.next_button, LEFT)
    qtbot.mouseClick(tour.back_button, LEFT)
    assert tour.number == 0
    qtbot.mouseClick(tour.end_button, LEFT)
    assert tour.number is None
    assert not tour.ring.isVisible()


def test_the_tour_stays_before_the_views_when_the_tab_that_it_points_at_is_clicked(qtbot, window):
    tour = window.tour
    tour.start()
    while "See" not in tour._title.text():
        qtbot.mouseClick(tour.next_button, LEFT)
    tabs = next(bar for bar in window.findChildren(QTabBar) if bar.tabText(1) == "Judge")
    qtbot.mouseClick(tabs, LEFT, pos=tabs.tabRect(1).center())
    assert window.judge.isVisible()
    center = in_window(window, tour.next_button).center()
    assert window.childAt(center) is tour.next_button
    tour.end()


def test_the_tour_leaves_the_smoothing_that_it_tells_of_to_be_seen(qtbot, window):
    tour = window.tour
    tour.start()
    while "Weights" not in tour._title.text():
        qtbot.mouseClick(tour.next_button, LEFT)
    for widget in (window.landmarks.smoothing_slider, window.landmarks.neighbourhood):
        assert not in_window(window, tour.bubble).intersects(in_window(window, widget))
    tour.end()


def test_the_tour_waits_for_two_brains_and_then_goes_on(qtbot, empty_window, project, results):
    tour = empty_window.tour
    tour.start()
    choices = in_window(empty_window, empty_window.start.choices)
    assert in_window(empty_window, tour.ring).contains(choices)
    assert "demo" in tour.next_button.text()  # there is nothing else to go on with
    empty_window.session.open(project)
    assert tour.number == 1
    assert tour.next_button.text() == "Next"
    settle(qtbot, empty_window)


# Help


def test_the_help_is_listed_and_searched(qtbot, empty_window):
    press(qtbot, empty_window, Qt.Key.Key_F1, Qt.KeyboardModifier.ShiftModifier)
    help_window = empty_window.findChild(HelpWindow)
    assert help_window.list.count() == len(PAGES) + 1
    assert "Two brains" in help_window.text.toPlainText()
    qtbot.keyClicks(help_window.search, "leave-one-out")
    found = [help_window.list.item(i).text() for i in range(help_window.list.count())]
    assert "Judging" in found
    assert len(found) < len(PAGES)
    help_window.list.setCurrentRow(found.index("Judging"))
    assert help_window.text.textCursor().selectedText().casefold() == "leave-one-out"
    help_window.search.setText("no page says this")
    assert help_window.list.count() == 0
    assert "Nothing about" in help_window.text.toPlainText()
    help_window.close()


def test_every_key_that_the_help_names_is_that_of_an_action(empty_window):
    keymap = empty_window.keymap
    keys = {key.toString() for name in keymap.names for key in keymap.keys_of(name)}
    for _, text in help_pages("")[:-1]:
        for word in text.replace("(", " ").replace(")", " ").replace(",", " ").split():
            if word.startswith(("Ctrl+", "Alt+")):
                assert word.rstrip(".") in keys


# Templates


@needs_templates
def test_two_templates_are_chosen_by_their_pictures(qtbot, monkeypatch, tmp_path):
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    labels = ("JFRC2", "FCWB")
    monkeypatch.setattr(template_browser, "template_labels", lambda: labels)
    dialog = TemplateBrowser()
    dialog.show()
    qtbot.waitUntil(lambda: all("vertices" in item.text() for item in dialog._items.values()))
    picture = dialog._items["FCWB"].icon().pixmap(*thumbnails.SIZE).toImage()
    colors = {picture.pixel(x, y) for x in range(0, 170, 7) for y in range(0, 110, 7)}
    assert len(colors) > 30
    for row, role in enumerate(("source", "target")):
        assert not dialog.open_button.isEnabled()
        dialog.list.setCurrentIndex(dialog._model.index(row, 0))
        qtbot.mouseClick(dialog.buttons[role], LEFT)
    monkeypatch.setattr(thumbnails, "drawn", None)  # those on disk are not drawn again
    again = TemplateBrowser()
    qtbot.waitUntil(lambda: all("vertices" in item.text() for item in again._items.values()))
    again.reject()
    again.deleteLater()
    qtbot.mouseClick(dialog.open_button, LEFT)
    assert tuple(brain.name for brain in dialog.inputs) == labels
    assert {brain.unit for brain in dialog.inputs} == {"um"}
    dialog.deleteLater()


def test_a_template_is_found_by_a_part_of_its_name(qtbot, monkeypatch):
    monkeypatch.setattr(template_browser, "template_labels", lambda: ("FAFB14", "FCWB", "JFRC2"))
    monkeypatch.setattr(thumbnails.Thumbnails, "ask", lambda *_: None)
    dialog = TemplateBrowser()
    dialog.show()
    qtbot.keyClicks(dialog.search, "fc")
    assert dialog.current == "FCWB"
    assert [dialog.list.isRowHidden(row) for row in range(3)] == [True, False, True]
    dialog.search.clear()
    assert not any(dialog.list.isRowHidden(row) for row in range(3))
    dialog.reject()
    dialog.deleteLater()


@needs_templates
def test_two_templates_are_opened_by_typing_their_names(qtbot, monkeypatch):
    monkeypatch.setattr(template_browser, "template_labels", lambda: ("FAFB14", "FCWB", "JFRC2"))
    monkeypatch.setattr(thumbnails.Thumbnails, "ask", lambda *_: None)
    dialog = TemplateBrowser()
    dialog.show()
    for name in ("FCWB", "JFRC2"):
        assert dialog.inputs is None
        qtbot.keyClicks(dialog.search, name)
        qtbot.keyClick(dialog.search, Qt.Key.Key_Return)
    assert dialog.chosen == {"source": "FCWB", "target": "JFRC2"}
    assert dialog.inputs is not None
    assert tuple(brain.name for brain in dialog.inputs) == ("FCWB", "JFRC2")
    dialog.deleteLater()


def test_without_flybrains_a_sentence_says_how_to_get_it(qtbot, monkeypatch):
    monkeypatch.setattr(template_browser, "template_labels", tuple)
    monkeypatch.setattr(template_browser, "is_installed", lambda: False)
    dialog = TemplateBrowser()
    assert "pip install flyreg[templates]" in dialog._problem.text()
    assert not dialog.open_button.isEnabled()
    dialog.reject()
    dialog.deleteLater()


# Without a mouse, without a screen

CONTROLS = (
    *(QAbstractButton, QAbstractItemView, QAbstractSlider, QAbstractSpinBox),
    *(QComboBox, QLineEdit, QProgressBar, QTextBrowser),
)


def controls_in(top):
    return [widget for widget in top.findChildren(QWidget) if isinstance(widget, CONTROLS)]


def is_for_tab(widget):
    """Tell whether the keyboard is to reach a control."""
    return (
        widget.isVisible()
        and widget.isEnabled()
        and bool(widget.focusPolicy() & Qt.FocusPolicy.TabFocus)
        and not isinstance(widget, QScrollBar)
        and not isinstance(widget.parent(), QComboBox | QAbstractSpinBox)  # these take the keys
        and not widget.objectName().startswith("qt_")  # a part of another control
    )


def cannot_be_reached(top):
    """The controls that a mouse can use and a keyboard cannot get to."""
    return [
        f"{widget.metaObject().className()} in {type(widget.parent()).__name__}"
        for widget in controls_in(top)
        if isinstance(widget, QAbstractButton | QAbstractSlider | QAbstractSpinBox | QComboBox)
        and not isinstance(widget, QScrollBar)
        and not isinstance(widget.parent(), QToolBar | QDockWidget | QAbstractItemView)
        and not widget.objectName().startswith("qt_")
        and not widget.isHidden()
        and not widget.focusPolicy() & Qt.FocusPolicy.TabFocus
    ]


def nameless(top):
    """The controls that a screen reader would only call by their kind."""
    found = []
    for widget in controls_in(top):
        is_part = isinstance(widget, QScrollBar | QHeaderView) or isinstance(
            widget.parent(), QAbstractSpinBox | QComboBox | QTabBar | QHeaderView
        )
        is_inner = widget.objectName().startswith("qt_") or (
            widget.metaObject().className() in ("QComboBoxListView", "QLineEditIconButton")
        )
        if is_part or is_inner or widget.isHidden():
            continue
        reader = QAccessible.queryAccessibleInterface(widget)
        if reader is None or not reader.text(QAccessible.Text.Name).strip():
            found.append(f"{widget.metaObject().className()} in {type(widget.parent()).__name__}")
    return found


DIALOGS = {
    "preferences": PreferencesDialog,
    "help": lambda w: HelpWindow(help_pages(""), MOUSE_AND_KEYS, w),
    "brains": lambda w: OpenBrainsDialog(w.preferences, w),
    "voxel size": lambda w: VoxelSizeDialog("a.tif", (1.0, 1.0, 1.0), w),
    "templates": TemplateBrowser,
}


def test_a_screen_reader_has_a_name_for_every_control(window):
    window.findChild(QDockWidget, "History").show()
    window.tunnels.set_on(True)
    window.steps.settings_button.setChecked(True)
    curves = CurvesDialog(window.session.results, window)
    curves.show()
    QApplication.processEvents()
    assert nameless(window) == []
    assert cannot_be_reached(window) == []
    curves.close()


@pytest.mark.parametrize("kind", DIALOGS)
def test_every_control_of_a_dialog_has_a_name_and_is_reached_by_tab(
    qtbot, empty_window, monkeypatch, kind
):
    monkeypatch.setattr(template_browser, "template_labels", tuple)
    dialog = DIALOGS[kind](empty_window)
    dialog.show()
    activate(qtbot, dialog)
    assert nameless(dialog) == []
    assert cannot_be_reached(dialog) == []
    wanted = [widget for widget in controls_in(dialog) if is_for_tab(widget)]
    wanted[0].setFocus(Qt.FocusReason.TabFocusReason)
    reached = []
    for _ in range(4 * len(wanted)):
        reached.append(QApplication.focusWidget())
        QTest.keyClick(reached[-1], Qt.Key.Key_Tab)
    assert [type(w).__name__ for w in wanted if w not in reached] == []
    dialog.close()
    dialog.deleteLater()


def test_tab_reaches_every_control_and_the_order_is_that_of_the_screen(qtbot, empty_window):
    window = empty_window
    activate(qtbot, window)
    reached = []
    window.start.open_button.setFocus(Qt.FocusReason.TabFocusReason)
    for _ in range(60):
        widget = QApplication.focusWidget()
        if widget in reached:
            break
        reached.append(widget)
        QTest.keyClick(widget, Qt.Key.Key_Tab)
    wanted = [widget for widget in controls_in(window) if is_for_tab(widget)]
    assert wanted
    assert [w for w in wanted if w not in reached] == []
    start = window.start
    ways = [start.open_button, start.templates_button, start.project_button, start.demo_button]
    order = [reached.index(button) for button in ways]
    assert order == sorted(order)
    steps = [window.steps.open_button, window.steps.settings_button, window.steps.tunnels_button]
    order = [reached.index(button) for button in steps]
    assert order == sorted(order)


def test_enter_on_a_button_that_tab_reached_presses_it(qtbot, empty_window):
    button = empty_window.steps.settings_button
    button.setFocus(Qt.FocusReason.TabFocusReason)
    QTest.keyClick(button, Qt.Key.Key_Space)
    assert empty_window.steps.form.isVisible()
    assert not empty_window.mode.is_on
