"""Nothing is lost: what is not saved survives a crash, and is offered at the next start."""

from __future__ import annotations

import os
import random
import shutil
from dataclasses import replace

import pytest

from flyreg_core import edits
from flyreg_core.project_file import load_project, read_notes, save_project

pytest.importorskip("PySide6")
from flyreg_gui.autosave import (
    PATH,
    autosave_folder,
    find_left_overs,
    in_words,
)
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication, QMessageBox

from tests.app.hands import LEFT
from tests.app.killing import EditingProgram, seconds_lost

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]


def kept_files():
    return sorted(autosave_folder().glob("*.flyreg"))


def edit(window, smoothing=0.5):
    window.session.edit("change smoothing", edits.set_smoothing(window.session.project, smoothing))


@pytest.fixture
def nowhere(project, tmp_path):
    """A project whose brains are gone: it opens, and costs nothing."""
    gone = replace(project.source.input, name="gone", path="/nowhere/gone.ply")
    brain = replace(project.source, input=gone)
    path = tmp_path / "x.flyreg"
    save_project(replace(project, source=brain, target=brain), path)
    return path


def test_a_change_is_kept_after_a_while_and_dropped_when_it_is_saved(
    qtbot, empty_window, nowhere, tmp_path
):
    before = nowhere.read_bytes()
    empty_window.autosave.set_seconds(0.1)
    empty_window.files.open_project_file(nowhere)
    qtbot.wait(300)
    assert kept_files() == []  # nothing was changed
    edit(empty_window)
    qtbot.waitUntil(lambda: len(kept_files()) == 1)
    assert load_project(kept_files()[0]).smoothing == 0.5
    assert read_notes(kept_files()[0])[PATH] == str(nowhere)
    assert nowhere.read_bytes() == before
    assert find_left_overs() == []  # its program runs
    empty_window.files.save()
    qtbot.waitUntil(lambda: kept_files() == [])
    edit(empty_window, 0.25)
    qtbot.waitUntil(lambda: len(kept_files()) == 1)
    empty_window.session.undo_stack.undo()
    qtbot.waitUntil(lambda: kept_files() == [])


def test_giving_changes_up_leaves_nothing_behind(qtbot, empty_window, nowhere):
    empty_window.files.open_project_file(nowhere)
    edit(empty_window)
    assert empty_window.autosave.save_now()

    def discard():
        box = QApplication.activeModalWidget()
        if isinstance(box, QMessageBox):
            qtbot.mouseClick(box.button(QMessageBox.StandardButton.Discard), LEFT)
        else:
            QTimer.singleShot(20, discard)

    QTimer.singleShot(20, discard)
    empty_window.close()
    assert list(autosave_folder().iterdir()) == []


def leave_over(project, path, age_seconds):
    """Write what a program that is no more would have left."""
    autosave_folder().mkdir(parents=True, exist_ok=True)
    kept = autosave_folder() / "0123.flyreg"
    save_project(edits.set_smoothing(project, 0.75), kept, {PATH: str(path)})
    moment = path.stat().st_mtime + age_seconds
    os.utime(kept, (moment, moment))
    return kept


def test_what_is_left_is_offered_recovered_as_unsaved_and_kept_again(qtbot, empty_window, nowhere):
    kept = leave_over(load_project(nowhere), nowhere, 180)
    bar = empty_window.recovery
    bar.look()
    assert bar.text == "flyreg ended early. Recover “x.flyreg”, 3 minutes newer than the file?"
    qtbot.mouseClick(bar.recover_button, LEFT)
    assert empty_window.session.project.smoothing == 0.75
    assert empty_window.session.path == nowhere
    assert empty_window.session.unsaved_changes == ["changes recovered"]
    assert empty_window.isWindowModified()
    assert bar.text == ""
    assert not kept.exists()
    (own,) = kept_files()  # a second crash would lose nothing either
    assert load_project(own).smoothing == 0.75
    edit(empty_window)
    empty_window.session.undo_stack.undo()
    assert empty_window.session.unsaved_changes == ["changes recovered"]
    assert empty_window.files.save()
    assert empty_window.session.unsaved_changes == []
    assert load_project(nowhere).smoothing == 0.75


def test_what_was_never_saved_is_offered_by_the_names_of_its_brains(empty_window, nowhere):
    empty_window.session.open(load_project(nowhere))
    edit(empty_window)
    assert empty_window.autosave.save_now()
    (own,) = kept_files()
    shutil.copy(own, own.with_name("another.flyreg"))  # as a program leaves it that was killed
    bar = empty_window.recovery
    bar.look()
    assert "Recover gone on gone that was never saved" in bar.text


def test_what_is_left_can_wait_or_be_discarded(qtbot, empty_window, nowhere):
    kept = leave_over(load_project(nowhere), nowhere, -7200)
    bar = empty_window.recovery
    bar.look()
    assert "2 hours older than the file" in bar.text
    assert find_left_overs() == []  # a second program does not offer it too
    qtbot.mouseClick(bar.later_button, LEFT)
    assert kept.exists()
    bar.look()
    qtbot.mouseClick(bar.discard_button, LEFT)
    assert not kept.exists()
    assert bar.text == ""


def test_a_folder_that_cannot_be_written_is_told(qtbot, empty_window, nowhere):
    autosave_folder().parent.mkdir(parents=True, exist_ok=True)
    autosave_folder().write_text("a file where the folder should be")
    empty_window.files.open_project_file(nowhere)
    qtbot.waitUntil(lambda: empty_window.session.failure is not None)
    edit(empty_window)
    assert not empty_window.autosave.save_now()
    assert "not kept for recovery" in empty_window.banner.text


def test_programs_killed_at_random_moments_lose_at_most_what_they_may(nowhere, tmp_path):
    seed = random.randrange(2**32)
    chance = random.Random(seed)
    moments = {"early": chance.uniform(0.0, 2.0), "late": chance.uniform(3.5, 5.0)}
    programs = {}
    for name in moments:
        shutil.copy(nowhere, tmp_path / f"{name}.flyreg")
        record = tmp_path / f"{name}.txt"
        programs[name] = EditingProgram(tmp_path / f"{name}.flyreg", 1.0, record)
    for name, moment in moments.items():
        programs[name].kill_after(moment)
    found = {left.project_path.stem: left for left in find_left_overs()}
    assert "late" in found, f"seed {seed}"
    for name, program in programs.items():
        smoothing = found[name].load().smoothing if name in found else 0.0
        assert seconds_lost(program.edits(), smoothing) <= 5.0, f"seed {seed}"
    for left in found.values():
        left.keep()


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.2, "1 second"), (42, "42 seconds"), (61, "1 minute"), (7300, "2 hours"), (9e4, "1 day")],
)
def test_a_length_of_time_is_said_in_words(seconds, words):
    assert in_words(seconds) == words
