"""Copying the command that repeats what is on show; the mesh that is exported."""

from __future__ import annotations

import filecmp
import shlex
from dataclasses import replace

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication

from flyreg_core.arguments import make_parser
from flyreg_core.cli import _COMMANDS, _project
from flyreg_core.report import write_registered
from tests.app.hands import CONTROL, answer_file_dialog, press

pytestmark = pytest.mark.window
CONTROL_SHIFT = CONTROL | Qt.KeyboardModifier.ShiftModifier


def test_a_command_is_copied_without_a_project_file(qtbot, window):
    project = replace(window.session.project, smoothing=0.037)
    window.session.edit("change smoothing", project)
    press(qtbot, window, Qt.Key.Key_C, CONTROL_SHIFT)
    words = shlex.split(QGuiApplication.clipboard().text())
    assert "--project" not in words
    assert _project(make_parser(_COMMANDS).parse_args(words[1:])) == project


def test_what_a_command_cannot_say_is_told_and_nothing_is_copied(qtbot, window):
    QGuiApplication.clipboard().setText("mine")
    weights = {"corner-upper-left": 2.0}
    window.session.edit("change weight", replace(window.session.project, weights=weights))
    press(qtbot, window, Qt.Key.Key_C, CONTROL_SHIFT)
    assert window.banner.text.startswith("A command cannot say weights; save the project")
    assert QGuiApplication.clipboard().text() == "mine"


def test_the_exported_mesh_is_that_of_the_command_byte_for_byte(qtbot, window, tmp_path):
    path, expected = tmp_path / "mine.ply", tmp_path / "command.ply"
    write_registered(expected, window.session.results)
    answer_file_dialog(path)
    press(qtbot, window, Qt.Key.Key_E, CONTROL)
    qtbot.waitUntil(path.exists)
    assert filecmp.cmp(path, expected, shallow=False)
    assert b"weight_influence" in path.read_bytes()
