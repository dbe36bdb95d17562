"""What a click means is what is drawn under it, on every screen."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from flyreg_core.rectangle import from_plane

pytest.importorskip("PySide6")
from PySide6.QtCore import QPointF
from PySide6.QtWidgets import QApplication

from tests.app.hands import LONG_MS
from tests.app.picks import window_mispicks

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]
ROOT = Path(__file__).parents[2]


def test_clicks_in_all_five_views_mean_the_face_that_is_drawn_there(window):
    area = window.view_area
    for turn in range(2):
        area.source.canvas.renderer.GetActiveCamera().Azimuth(65)
        area.source.canvas.camera_moved.emit()
        QApplication.processEvents()
        for name in ("source", "target", "registered", "anterior", "posterior"):
            assert window_mispicks(window, name, 100, turn) == []


def test_clicks_on_the_flat_halves_mean_the_triangle_that_is_drawn_there(window):
    """Against all triangles of the half, one after the other; the last one covers the others."""
    rng, area, results = np.random.default_rng(1), window.view_area, window.session.results
    window.view_area.pointer._results = results
    finder = window.view_area.pointer._up_to_date_finder(results)
    for view in area.flat_views:
        warped = results.registration.halves[view.half]
        corners = warped.plane[warped.flat.faces]
        faces = results.source.flat.dissection.piece_of_face == ("anterior", "posterior").index(
            view.half
        )
        numbers, checked = np.flatnonzero(faces), 0
        while checked < 150:
            position = QPointF(*rng.uniform([0, 0], [view.canvas.width(), view.canvas.height()]))
            point = view.plane_at(position)
            pixels, _ = view.canvas.to_pixels(np.array([[*point, 0.0]]))
            np.testing.assert_allclose(pixels[0], [position.x(), position.y()], atol=1e-6)
            same = finder.from_plane(view.half, point)
            beta = from_plane(point[None])[1][0]
            if not 0.01 < beta < 0.99:
                continue
            a, b, c = (corners[:, k] - point for k in range(3))
            areas = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], axis=1)
            around = (areas >= -1e-12).all(axis=1) | (areas <= 1e-12).all(axis=1)
            assert same.source.face == numbers[around].max()
            checked += 1


def _cross(a, b):
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def test_a_thousand_clicks_at_two_pixels_per_point_never_miss():
    run = subprocess.run(
        [sys.executable, "-m", "tests.app.picks"],
        cwd=ROOT,
        env={
            **os.environ,
            "QT_SCALE_FACTOR": "2",
            "PYTHONPATH": os.pathsep.join(sys.path),
        },
        capture_output=True,
        text=True,
        timeout=LONG_MS / 1000,
        check=False,
    )
    assert run.stdout.startswith("pixels per point 2, mispicks 0 "), run.stdout + run.stderr
