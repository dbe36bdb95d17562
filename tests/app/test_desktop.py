"""At home on a desktop: files dropped, pictures, themes, keys, and what is copied."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flyreg_core import edits
from flyreg_core.errors import Cancelled
from flyreg_core.landmark_tables import write_bigwarp
from flyreg_core.landmarks import LandmarkPair
from flyreg_core.named_pairs import NamedPair
from flyreg_core.project_file import load_project, save_project
from flyreg_core.script import register_command

pytest.importorskip("PySide6")
from flyreg_gui import pictures
from flyreg_gui.actions import SPECS
from flyreg_gui.dialogs import OpenBrainsDialog
from flyreg_gui.help_window import MOUSE_AND_KEYS, HelpWindow
from flyreg_gui.keymap import Keymap
from flyreg_gui.pictures import write_turn
from flyreg_gui.preferences import Preferences
from flyreg_gui.preferences_dialog import PreferencesDialog
from flyreg_gui.theme import current_theme, set_scheme
from PySide6.QtCore import QMimeData, QPointF, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent, QGuiApplication, QKeySequence
from PySide6.QtWidgets import QAbstractButton, QApplication, QMessageBox, QProgressDialog

from tests.app.hands import CONTROL, LEFT, answer_file_dialog, press, settle, when_asked

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]

CHECKOUT = Path(__file__).parents[2]
SHIFT = Qt.KeyboardModifier.ShiftModifier


def drop(window, *paths):
    """Drag files over the window and let them go."""
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(path)) for path in paths])
    place = QPointF(window.rect().center())
    enter = QDragEnterEvent(
        *(place.toPoint(), Qt.DropAction.CopyAction, data),
        *(Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier),
    )
    QApplication.sendEvent(window, enter)
    assert enter.isAccepted()
    event = QDropEvent(
        *(place, Qt.DropAction.CopyAction, data),
        *(Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier),
    )
    QApplication.sendEvent(window, event)


# Files dropped


def test_two_brains_dropped_are_a_pair_that_is_remembered(qtbot, empty_window, demo_files):
    when_asked(OpenBrainsDialog, lambda dialog: dialog._open_button.click())
    drop(empty_window, *demo_files)
    qtbot.waitUntil(lambda: empty_window.session.project is not None)
    project = empty_window.session.project
    assert (project.source.input.path, project.target.input.path) == tuple(map(str, demo_files))
    ((source, target),) = Preferences().recent_pairs
    assert (source.name, target.name) == tuple(map(str, demo_files))
    empty_window.menus.fill_recent()
    (action,) = empty_window.menus.recent_pairs.actions()
    assert action.text() == "source.ply on target.ply"
    before = empty_window.session.project
    action.trigger()
    assert empty_window.session.project is not before
    assert empty_window.session.project == before


def test_a_project_dropped_is_opened(qtbot, empty_window, project, tmp_path):
    save_project(project, tmp_path / "p.flyreg")
    drop(empty_window, tmp_path / "p.flyreg")
    qtbot.waitUntil(lambda: empty_window.session.path == tmp_path / "p.flyreg")


def test_one_brain_dropped_asks_whose_place_it_takes(qtbot, window, demo_files):
    def answer(box):
        button = next(b for b in box.buttons() if b.text() == "Target")
        qtbot.mouseClick(button, LEFT)

    when_asked(QMessageBox, answer)
    drop(window, demo_files[0])
    qtbot.waitUntil(lambda: window.session.undo_stack.count() == 1)
    assert window.session.project.target.input.path == str(demo_files[0])
    assert window.session.unsaved_changes == ["open another target"]
    window.session.undo_stack.undo()
    settle(qtbot, window)


def test_landmarks_dropped_are_imported_in_one_step(qtbot, window, tmp_path):
    file = tmp_path / "pairs.csv"
    pairs = [NamedPair(f"p{i}", (10.0 * i, 0.0, 5.0), (10.0 * i, 1.0, 5.0)) for i in range(3)]
    write_bigwarp(file, pairs)
    drop(window, file)
    qtbot.waitUntil(lambda: len(window.session.project.pairs) == 3)
    assert window.session.undo_stack.count() == 1
    settle(qtbot, window)
    file.write_text("no, landmarks")
    drop(window, file)
    qtbot.waitUntil(lambda: "pairs.csv" in window.banner.text)
    assert window.session.undo_stack.count() == 1


def test_many_files_are_refused_with_a_sentence(qtbot, empty_window, demo_files):
    drop(empty_window, *demo_files, demo_files[0])
    qtbot.waitUntil(lambda: "3 files were dropped" in empty_window.banner.text)


# Keys and themes


def test_every_action_is_in_a_menu(empty_window):
    def within(menu):
        for action in menu.actions():
            yield action
            if action.menu() is not None:
                yield from within(action.menu())

    shown = {action.objectName() for action in within(empty_window.menuBar())}
    assert {spec.name for spec in SPECS} <= shown


def test_no_two_actions_have_the_same_key(empty_window):
    keymap = empty_window.keymap
    keys = [key.toString() for name in keymap.names for key in keymap.keys_of(name)]
    assert len(keys) == len(set(keys))


def test_a_key_is_changed_unless_it_is_taken_and_the_help_shows_it(qtbot, empty_window):
    window = empty_window
    press(qtbot, window, Qt.Key.Key_Comma, CONTROL)
    dialog = window.findChild(PreferencesDialog)
    page = dialog.keys
    for key, problem in (("Ctrl+S", "Ctrl+S already means “Save project”"), ("Ctrl+J", "")):
        page.edits["export"].setKeySequence(QKeySequence(key))
        page.edits["export"].editingFinished.emit()
        assert page.problem.text().startswith(problem)
    assert [key.toString() for key in window.keymap.keys_of("export")] == ["Ctrl+J"]
    window.show_help(MOUSE_AND_KEYS)
    shown = window.findChild(HelpWindow).text.toPlainText()
    assert "Ctrl+J" in shown
    assert "Ctrl+E" not in shown
    assert "Ctrl+Z" in shown
    again = Keymap(window.actions_by_name, Preferences())  # as the next program finds it
    assert [key.toString() for key in again.keys_of("export")] == ["Ctrl+J"]
    qtbot.mouseClick(page.reset_button, LEFT)
    assert [key.toString() for key in window.keymap.keys_of("export")] == ["Ctrl+E"]
    assert Preferences().keys == {}
    window.findChild(HelpWindow).close()
    dialog.close()


def test_how_soon_changes_are_kept_is_chosen_and_remembered(empty_window):
    dialog = PreferencesDialog(empty_window)
    dialog.seconds.setValue(7)
    assert empty_window.autosave.seconds == 7
    assert Preferences().autosave_seconds == 7
    dialog.close()
    dialog.deleteLater()


def is_dark(image, x, y):
    return image.pixelColor(x, y).lightness() < 128


def test_the_window_turns_dark_and_light_and_remembers(qtbot, window):
    canvas = window.view_area.source.canvas
    try:
        for dark in (True, False):
            set_scheme("light" if dark else "dark")
            press(qtbot, window, Qt.Key.Key_T, CONTROL | SHIFT)
            assert current_theme().is_dark is dark
            assert Preferences().scheme == ("dark" if dark else "light")
            qtbot.waitUntil(lambda dark=dark: is_dark(canvas.grabFramebuffer(), 5, 5) is dark)
            qtbot.waitUntil(lambda dark=dark: is_dark(window.grab().toImage(), 300, 40) is dark)
    finally:
        set_scheme("system")


# Pictures


def test_the_buttons_of_docks_are_seen_on_dark_and_on_light(qtbot, window):
    for scheme in ("dark", "light"):
        window.set_scheme(scheme)
        for name in ("qt_dockwidget_closebutton", "qt_dockwidget_floatbutton"):
            button = window.docks[0].findChild(QAbstractButton, name)
            image = button.icon().pixmap(16, 16).toImage()
            inks = [image.pixelColor(x, y) for x in range(16) for y in range(16)]
            inks = [ink for ink in inks if ink.alpha() > 200]
            assert inks
            ground = window.palette().window().color().lightness()
            assert all(abs(ink.lightness() - ground) > 100 for ink in inks)


def test_a_turn_is_written_as_gif_or_folder_or_cancelled_and_leaves_the_camera(
    window, tmp_path, monkeypatch
):
    frame = window.view_area.frames[2]
    before = window.view_area.registered.pose()
    write_turn(frame, tmp_path / "turn.gif", lambda _done: None, frames=3)
    with Image.open(tmp_path / "turn.gif") as gif:
        assert gif.n_frames == 3
        turned = []
        for number in range(3):
            gif.seek(number)
            turned.append(np.asarray(gif.convert("RGB"), dtype=int))
    assert all(np.abs(a - turned[0]).max() > 40 for a in turned[1:])
    write_turn(frame, tmp_path / "turn.png", lambda _done: None, frames=2)
    assert len(list((tmp_path / "turn").glob("*.png"))) == 2
    np.testing.assert_allclose(window.view_area.registered.pose().position, before.position)

    def cancel(done):
        if done == 2:
            raise Cancelled

    with pytest.raises(Cancelled):
        write_turn(frame, tmp_path / "second.gif", cancel, frames=4)
    assert not list(tmp_path.glob("*second*"))

    third = tmp_path / "third.gif"
    answer_file_dialog(third)
    when_asked(QProgressDialog, lambda dialog: dialog.cancel())
    window.actions_by_name["turn"].trigger()
    assert not third.exists()
    monkeypatch.setattr(pictures, "FRAMES", 3)
    answer_file_dialog(third)
    window.actions_by_name["turn"].trigger()
    assert third.is_file()


def test_pictures_of_one_view_and_of_all_are_of_their_size_and_not_blank(qtbot, window, tmp_path):
    area, frames = window.view_area, window.view_area.frames
    assert window.pictures.current is frames[2]
    qtbot.mouseClick(frames[0].canvas, LEFT, pos=frames[0].canvas.rect().topLeft())
    assert window.pictures.current is frames[0]
    for name, widget in (("picture_of_view", frames[0].canvas), ("picture_of_views", area)):
        path = tmp_path / f"{name}.png"
        answer_file_dialog(path)
        window.actions_by_name[name].trigger()
        with Image.open(path) as picture:
            assert picture.size == (widget.width(), widget.height())
            assert len(picture.convert("RGB").getcolors(10**6)) > 200


# What is copied


def test_what_is_copied_repeats_the_registration_to_the_last_bit(qtbot, window, tmp_path):
    session = window.session
    landmark = session.results.landmarks[0]
    place = tuple(float(x) for x in session.results.source.surface.vertices[700])
    end = tuple(float(x) for x in session.results.target.surface.vertices[700])
    changed = edits.set_weights(session.project, [landmark.pair.id], 3.1)
    changed = edits.set_smoothing(changed, 0.0123)
    pair = LandmarkPair("user-1", 'it\'s "mine"', "interior", None, place, end, 0.7)
    session.edit("change", edits.keep_snapshot(edits.add_pair(changed, pair), "A"))
    settle(qtbot, window)
    window.files.copy_python()
    script = tmp_path / "repeat.py"
    saving = "import numpy\nnumpy.save('vertices.npy', registered.vertices)\n"
    script.write_text(QGuiApplication.clipboard().text() + saving, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, str(script)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(CHECKOUT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    again = np.load(tmp_path / "vertices.npy")
    assert np.abs(again - session.results.registration.surface.vertices).max() == 0
    assert (tmp_path / "registered.ply").is_file()

    path = tmp_path / "it's mine.flyreg"
    assert window.files._save_to(path)
    window.files.copy_command()
    assert QGuiApplication.clipboard().text() == register_command(path)
    assert load_project(path).pairs == session.project.pairs
