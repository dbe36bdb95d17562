"""Somebody who never saw the program, with nothing but the mouse and the tour of the first start."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("PySide6")
import trimesh
from flyreg_gui import files
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QInputDialog, QTabBar

from tests.app.hands import LEFT, answer_file_dialog, pixel, settle

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]

MOST_CLICKS = 14


class Mouse:
    """Clicks as a user does, and counts them."""

    def __init__(self, qtbot):
        self._qtbot, self.clicks = qtbot, 0

    def click(self, widget, place=None):
        assert widget.isVisible()
        assert widget.isEnabled()
        QTest.mouseMove(widget, place or widget.rect().center())
        self._qtbot.mouseClick(widget, LEFT, pos=place or widget.rect().center())
        self.clicks += 1


def test_a_new_user_registers_weighs_a_neuropil_sees_what_it_did_and_exports(
    qtbot, empty_window, project, results, tmp_path, monkeypatch
):
    window, mouse = empty_window, Mouse(qtbot)
    monkeypatch.setattr(files, "demo_project", lambda: project)  # with coarse voxels
    assert not window.preferences.has_toured
    tour = window.tour
    tour.start()

    mouse.click(tour.next_button)  # there are no files at hand: "Take the demo"
    settle(qtbot, window)
    while tour.number is not None:
        mouse.click(tour.next_button)
    before = window.session.results.registration.surface.vertices

    # a landmark on the front, and what is near it
    mark = next(
        m for m in window.session.results.landmarks if m.pair.id.startswith("suggested-anterior")
    )
    canvas = window.view_area.frames[1].canvas
    mouse.click(canvas, pixel(canvas, mark.target_point))
    assert window.selection.ids
    bar = window.landmarks.neighbourhood
    mouse.click(bar.buttons[0])
    assert "landmark" in window.status.currentMessage()

    # a neuropil, which the button beside the list loads
    ball = trimesh.creation.icosphere(2, 40.0)
    ball.apply_translation(mark.target_point)
    path = tmp_path / "AL_L.ply"
    ball.export(path)
    answer_file_dialog(path)
    monkeypatch.setattr(QInputDialog, "getItem", lambda *arguments: (arguments[3][1], True))
    mouse.click(bar.load_button)
    qtbot.waitUntil(lambda: bar.place.currentText() == "AL_L (target)")
    mouse.click(bar.buttons[1])
    mouse.click(bar.buttons[1])
    assert "near AL_L" in window.session.undo_stack.undoText()
    settle(qtbot, window)
    after = window.session.results.registration.surface.vertices
    assert np.abs(after - before).max() > 0

    # what it did
    tabs = next(bar for bar in window.findChildren(QTabBar) if bar.tabText(1) == "Judge")
    mouse.click(tabs, tabs.tabRect(1).center())
    assert window.judge.isVisible()
    window.judge.choice.setFocus()
    for _ in range(2):
        qtbot.keyClick(window.judge.choice, Qt.Key.Key_Down)
    assert window.judging.chosen == "distance"
    qtbot.waitUntil(lambda: window.judging.is_up_to_date)

    exported = tmp_path / "mine.ply"
    answer_file_dialog(exported)
    mouse.click(window.steps.export_button)
    assert str(exported) in window.status.currentMessage()
    assert mouse.clicks <= MOST_CLICKS
