"""What is written in narrow views stays readable: labels, scales, lists of names, sentences."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("PySide6")
from flyreg_gui.failures import as_sentence
from flyreg_gui.judging import QUANTITIES
from flyreg_gui.theme import LIGHT
from flyreg_gui.views.canvas import FlatCanvas
from flyreg_gui.views.layers import LabelLayer
from flyreg_gui.views.view_frame import ViewFrame
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication, QMainWindow

from flyreg_core.color_maps import VIRIDIS

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]


@pytest.fixture
def frame(qtbot):
    """A narrow view in a window of its own; a point is a pixel, the middle is the origin."""
    window = QMainWindow()
    frame = ViewFrame("Source", "", None, FlatCanvas)
    window.setCentralWidget(frame)
    window.resize(160, 300)
    window.show()
    qtbot.waitExposed(window)
    camera = frame.canvas.renderer.GetActiveCamera()
    camera.SetParallelProjection(True)
    camera.SetPosition(0, 0, 5)
    camera.SetParallelScale(frame.canvas.height() / 2)
    frame.show_theme(LIGHT)
    frame.canvas.show_theme(LIGHT)
    yield frame
    frame.canvas.end()
    window.close()
    window.deleteLater()


def columns_drawn(canvas):
    """How many columns of the picture are not all background."""
    canvas.render()
    QApplication.processEvents()
    image = canvas.grabFramebuffer().convertToFormat(QImage.Format.Format_Grayscale8)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    gray = rows[:, : image.width()].astype(int)
    return int((np.ptp(gray, axis=0) > 3).sum())


def test_a_label_at_the_right_border_is_written_to_the_left_of_its_point_and_whole(frame):
    labels = LabelLayer(frame.canvas)
    labels.set_style(LIGHT.text, LIGHT.background, frame.canvas.devicePixelRatioF())
    labels.show(np.array([[-60.0, 0, 0]]), ["upper left"])
    whole = columns_drawn(frame.canvas)
    labels.show(np.array([[65.0, 0, 0]]), ["upper left"])
    assert columns_drawn(frame.canvas) == pytest.approx(whole, abs=2)
    labels.show(np.array([[-60.0, 0, 0]]), ["upper left"])
    assert columns_drawn(frame.canvas) == whole


class OfDistance:
    """A scale as colours by distance have it."""

    quantity, color_map, low, high, is_kinds = QUANTITIES[0], VIRIDIS, 0.0, 123.4, False


def test_scales_fit_into_a_narrow_view_with_the_numbers_of_both_ends(frame):
    frame.show_scale(OfDistance())
    frame.show_marker_scale(OfDistance())
    for scale in (frame.scale, frame.marker_scale):
        assert frame.canvas.geometry().contains(scale.geometry())
        assert [scale.texts[0][0], scale.texts[-1][:3]] == ["0", "123"]
    assert not frame.scale.geometry().intersects(frame.marker_scale.geometry())


def test_the_title_of_a_scale_takes_more_lines_in_a_narrow_view(frame):
    frame.show_scale(OfDistance())
    narrow = frame.scale.height()
    frame.scale.fit_into(400)
    assert narrow == frame.scale.height() + frame.fontMetrics().height()


def test_a_list_of_many_long_names_leaves_most_of_the_view_free_and_tells_all_in_its_tip(frame):
    names = [f"a very long name of neuropil number {number}" for number in range(40)]
    frame.show_names([((0, 0, 0), name) for name in names])
    shown, room = frame.names.geometry(), frame.canvas.geometry()
    assert room.contains(shown)
    assert shown.height() < 0.4 * room.height()
    assert "more" in frame.names.text()
    assert frame.names.toolTip().splitlines() == names


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("the oesophagus is a guess", "The oesophagus is a guess"),
        ("landmarks.csv, line 4: no number", "landmarks.csv, line 4: no number"),
        ("/home/fly/brain: is gone", "/home/fly/brain: is gone"),
        ("source: it is closed.", "Source: it is closed."),
        ("", ""),
    ],
)
def test_sentences_begin_with_a_capital_and_file_names_stay_as_they_are(text, sentence):
    assert as_sentence(text) == sentence
