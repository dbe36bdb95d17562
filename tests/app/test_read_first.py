"""What was read of the brains is on show before they are prepared."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("PySide6")
from PySide6.QtWidgets import QApplication

from tests.app.hands import LONG_MS, drawn, settle

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]


def test_brains_are_shown_as_read_while_they_are_prepared(
    qtbot, empty_window, pipeline, project, memory
):
    for memo, remembered in memory:
        memo._remembered = list(remembered)
    window, area = empty_window, empty_window.view_area
    source = replace(project.source, solid=replace(project.source.solid, voxels_across=41))
    unprepared = replace(project, source=source)
    assert pipeline.is_prepared(project)
    assert not pipeline.is_prepared(unprepared)
    window.session.open(unprepared)
    qtbot.waitUntil(lambda: len(window.session.read) == 2, timeout=LONG_MS)
    assert window.session.results is None
    for role, frame, view in zip(
        ("source", "target"), area.frames, area.surface_views, strict=False
    ):
        raw, _ = pipeline.raw(getattr(unprepared, role))
        np.testing.assert_allclose(drawn(view), raw.vertices, atol=1e-3)
        assert "prepared" in frame._caption.text()
        assert frame._caption.isVisible()
        assert not frame._note.isVisible()
    assert area.frames[2]._note.isVisible()
    window.session.open(project)  # nothing of the other project stays
    assert window.session.read == {}
    settle(qtbot, window)
    assert not any(frame._caption.isVisible() for frame in area.frames)
    assert len(drawn(area.source)) == len(window.session.results.source.surface.vertices)


def test_a_brain_that_cannot_be_read_is_told_of_once_and_the_other_is_shown(
    qtbot, empty_window, project, tmp_path
):
    gone = replace(project.source.input, path=str(tmp_path / "gone.ply"))
    window = empty_window
    window.session.open(replace(project, source=replace(project.source, input=gone)))
    qtbot.waitUntil(lambda: window.session.failure is not None, timeout=LONG_MS)
    assert "gone.ply" in window.banner.text
    raw = window.session.remains.brains["target"].surface
    np.testing.assert_allclose(drawn(window.view_area.target), raw.vertices, atol=1e-3)
    assert not window.view_area.frames[1]._caption.isVisible()


def test_a_window_that_is_closed_while_a_brain_is_read_draws_it_no_more(
    qtbot, empty_window, project
):
    source = replace(project.source, solid=replace(project.source.solid, voxels_across=42))
    window = empty_window
    with qtbot.captureExceptions() as exceptions:
        window.session.open(replace(project, source=source))
        qtbot.waitUntil(lambda: window.session.work != "", timeout=LONG_MS)
        window.close()
        QApplication.processEvents()
    assert exceptions == []
    assert not window.isVisible()
