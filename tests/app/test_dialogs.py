"""The dialogs that open brains: which files they offer, and what they ask about volumes."""

from __future__ import annotations

import nrrd
import numpy as np
import pytest

from flyreg_core.brain_files import READ

pytest.importorskip("PySide6")
from flyreg_gui.dialogs import BRAIN_FILTER, OpenBrainsDialog, VoxelSizeDialog
from flyreg_gui.preferences import Preferences
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication, QDialogButtonBox, QLabel

BUTTONS = QDialogButtonBox.StandardButton


@pytest.fixture
def volume(tmp_path):
    """Labels whose file does not say how large a voxel is."""
    labels = np.zeros((40, 30, 20), dtype=np.uint8)
    labels[5:35, 5:25, 5:15] = 1
    path = tmp_path / "labels.nrrd"
    nrrd.write(str(path), labels)
    return path


@pytest.fixture
def dialog(qtbot, volume, demo_files):
    dialog = OpenBrainsDialog(Preferences())
    qtbot.addWidget(dialog)
    dialog.source.name.setEditText(str(volume))
    dialog.target.name.setEditText(str(demo_files[1]))
    dialog.show()
    yield dialog
    dialog.close()
    dialog.deleteLater()


def answer(button, edges=()):
    """Fill in the next voxel size dialog and click one of its buttons; return what it says."""
    said = []

    def click():
        asked = QApplication.activeModalWidget()
        if not isinstance(asked, VoxelSizeDialog):
            QTimer.singleShot(20, click)
            return
        said.append(asked.findChild(QLabel).text())
        for box, edge in zip(asked.edges, edges, strict=False):
            box.setValue(edge)
        asked.buttons.button(button).click()

    QTimer.singleShot(20, click)
    return said


def test_every_ending_that_can_be_read_is_offered():
    assert all(f"*{ending}" in BRAIN_FILTER for ending in READ)


def test_the_voxel_size_is_asked_for_where_a_volume_lacks_it(dialog):
    said = answer(BUTTONS.Ok, (8.0, 9.0, 10.0))
    dialog._open_button.click()
    assert "labels.nrrd does not say how large its voxels are" in said[0]
    source, target = dialog.inputs
    assert source.voxel_size_um == (8.0, 9.0, 10.0)
    assert source.kind == "label volume"
    assert target.voxel_size_um is None


def test_without_an_answer_the_dialog_stays_open_and_says_why(dialog):
    answer(BUTTONS.Cancel)
    dialog._open_button.click()
    assert dialog.inputs is None
    assert dialog.isVisible()
    assert "does not say how large its voxels are" in dialog._problem.text()


def test_an_impossible_voxel_size_is_refused_with_a_sentence(dialog):
    answer(BUTTONS.Ok, (0.001, 0.001, 0.001))
    dialog._open_button.click()
    assert dialog.inputs is None
    assert "labels.nrrd" in dialog._problem.text()
