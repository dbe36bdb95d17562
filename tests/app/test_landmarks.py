"""What a biologist does with landmarks: places, drags, mutes, mirrors, weighs and lists them."""

import re

import numpy as np
import pytest
import trimesh

from flyreg_core import edits
from flyreg_core.landmark_files import read_landmark_pairs
from flyreg_core.landmarks import CORNERS
from flyreg_core.named_pairs import end_of

pytest.importorskip("PySide6")
from flyreg_gui.landmark_table import Column, Judged
from flyreg_gui.panels.neighbourhood import SELECTED
from flyreg_resources import landmark_lists
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtWidgets import QInputDialog, QMenu

from tests.app.hands import (
    CONTROL,
    LEFT,
    answer_file_dialog,
    drag,
    pixel,
    press,
    pulling_aside,
    settle,
)


def middle(canvas, right=0.0, down=0.0):
    """A place of a canvas, so far from its middle in shares of its size."""
    away = QPoint(round(right * canvas.width()), round(down * canvas.height()))
    return canvas.rect().center() + away


def click(qtbot, canvas, right=-0.12, down=-0.05):
    qtbot.mouseClick(canvas, LEFT, pos=middle(canvas, right, down))


def enter_mode(qtbot, window):
    press(qtbot, window, Qt.Key.Key_Space)
    assert window.mode.is_on


def front_mark(window, origin="suggested", kind="interior"):
    """A landmark that can be seen and clicked in the view of the target."""
    view = window.view_area.target
    return next(
        mark
        for mark in window.session.results.landmarks
        if (mark.pair.origin, mark.pair.kind) == (origin, kind)
        and mark.pair.id not in CORNERS
        and view.landmark_at(QPointF(pixel(view.canvas, mark.target_point))) == mark.pair.id
    )


def own_pair(qtbot, window):
    """A landmark of the user's own, made by two clicks."""
    area = window.view_area
    enter_mode(qtbot, window)
    click(qtbot, area.source.canvas)
    click(qtbot, area.target.canvas)
    settle(qtbot, window)
    (pair,) = window.session.project.pairs
    return pair


def text_of(window, identifier, column):
    model = window.landmarks.model
    return model.data(model.index(model.ids.index(identifier), column))


def test_a_half_made_pair_is_seen_in_view_and_table_and_survives_the_mode(qtbot, window):
    view = window.view_area.source
    enter_mode(qtbot, window)
    click(qtbot, view.canvas)
    (pair,) = window.session.project.pairs
    press(qtbot, window, Qt.Key.Key_Space)
    settle(qtbot, window)
    assert window.session.project.pairs == (pair,)
    assert text_of(window, pair.id, Column.RESIDUAL) == "half"
    at = QPointF(pixel(view.canvas, pair.source))
    assert view.landmark_at(at) == pair.id
    enter_mode(qtbot, window)
    window.selection.select([pair.id])
    click(qtbot, window.view_area.target.canvas)
    settle(qtbot, window)
    assert window.session.project.pairs[0].is_placed
    assert view._half_made_ids == ()


def test_a_landmark_is_dragged_over_the_surface_and_stays_on_it_in_one_undo_step(qtbot, window):
    pair, view = own_pair(qtbot, window), window.view_area.target
    steps, surface = window.session.undo_stack.count(), window.session.results.target.surface
    start = pixel(view.canvas, pair.target)
    places = [start, *(start + QPoint(8 * k, 5 * k) for k in (1, 2, 3))]
    drag(qtbot, view.canvas, places, lambda: None)
    settle(qtbot, window)
    moved = window.session.project.pairs[0].target
    assert (pixel(view.canvas, moved) - places[-1]).manhattanLength() <= 2
    assert surface.tree.nearest(np.array([moved]))[0][0] < 1e-12
    assert window.session.undo_stack.count() == steps + 1
    press(qtbot, window, Qt.Key.Key_Z, CONTROL)
    assert window.session.project.pairs[0].target == pair.target


def test_turning_the_brain_never_moves_a_landmark(qtbot, window):
    pair, canvas = own_pair(qtbot, window), window.view_area.target.canvas
    press(qtbot, window, Qt.Key.Key_Space)
    start = pixel(canvas, pair.target)
    drag(qtbot, canvas, [start, start + QPoint(40, 10)], lambda: None)
    assert window.session.project.pairs == (pair,)
    assert pixel(canvas, pair.target) != start


def test_a_landmark_on_a_curve_slides_along_it(qtbot, window):
    enter_mode(qtbot, window)
    mark, view = front_mark(window, "boundary", "upper"), window.view_area.target
    start = pixel(view.canvas, mark.target_point)
    drag(qtbot, view.canvas, [start, start + QPoint(14, 30)], lambda: None)
    settle(qtbot, window)
    share = window.session.project.moved[mark.pair.id]
    curve = window.session.results.target.flat.curves["upper", None]
    now = next(m for m in window.session.results.landmarks if m.pair.id == mark.pair.id)
    others = [m.pair for m in window.session.results.landmarks if m.pair.kind == "upper"]
    targets = [pair.target for pair in sorted(others, key=lambda pair: pair.source)]
    assert share != mark.pair.target
    assert targets == sorted(targets)
    assert now.target_point == pytest.approx(curve.at(np.array([share]))[0])


def test_a_suggestion_that_is_dragged_becomes_the_users_own(qtbot, window):
    enter_mode(qtbot, window)
    mark, view = front_mark(window), window.view_area.target
    start = pixel(view.canvas, mark.target_point)
    inwards = middle(view.canvas) - start
    drag(qtbot, view.canvas, [start, start + inwards / 8], lambda: None)
    settle(qtbot, window)
    (pair,) = window.session.project.pairs
    assert pair.origin == "user"
    assert window.session.project.weights[mark.pair.id] == 0
    assert window.session.undo_stack.count() == 1


def test_landmarks_on_a_curve_are_placed_by_clicks_beside_it(qtbot, window):
    window.mode.set_kind("hole")
    pair = own_pair(qtbot, window)
    assert (pair.kind, pair.half) == ("hole", None)
    assert 0 <= pair.source < 1
    assert 0 <= pair.target < 1


def test_a_landmark_is_placed_by_two_clicks_on_a_flat_half(qtbot, window):
    view = window.view_area.anterior
    enter_mode(qtbot, window)
    clicked = [middle(view.canvas, -0.2, 0.1), middle(view.canvas, -0.18, 0.12)]
    places = [view.plane_at(QPointF(place)) for place in clicked]
    before = window.session.results.registration.halves["anterior"]
    for place in clicked:
        qtbot.mouseClick(view.canvas, LEFT, pos=place)
    settle(qtbot, window)
    (pair,) = window.session.project.pairs
    mark = next(m for m in window.session.results.landmarks if m.pair.id == pair.id)
    start, end = mark.plane["anterior"]
    assert end == pytest.approx(places[1], abs=2e-3)
    own = window.session.results.source.halves["anterior"]
    nearest = np.linalg.norm(own.plane - start, axis=1).argmin()
    assert before.plane[nearest] == pytest.approx(places[0], abs=0.1)


def test_a_list_of_landmarks_is_placed_in_order_and_each_can_be_skipped(qtbot, window, tmp_path):
    path = tmp_path / "names.txt"
    path.write_text("# mine\nAL_L\nAL_R, antennal lobe\nMB_CA_L\n")
    answer_file_dialog(path)
    window.actions_by_name["template"].trigger()
    assert [pair.name for pair in window.mode.unplaced] == ["AL_L", "AL_R", "MB_CA_L"]
    assert window.mode.is_on
    assert "AL_L" in window.status.hint.text()
    press(qtbot, window, Qt.Key.Key_D, CONTROL)
    assert window.mode.current.name == "AL_R"
    area = window.view_area
    click(qtbot, area.source.canvas)
    click(qtbot, area.target.canvas)
    assert window.mode.current.name == "MB_CA_L"
    settle(qtbot, window)
    placed = {pair.name: pair.is_placed for pair in window.session.project.pairs}
    assert placed == {"AL_L": False, "AL_R": True, "MB_CA_L": False}
    assert any("AL_L, MB_CA_L" in text for text in window.session.results.warnings)


@pytest.mark.parametrize("path", landmark_lists(), ids=lambda path: path.stem)
def test_each_list_that_comes_with_the_program_can_be_placed(qtbot, window, path):
    lists = window.findChild(QMenu, "Landmarks to place")
    title = path.stem.replace("-", " ").capitalize()
    next(action for action in lists.actions() if action.text() == title).trigger()
    assert len(window.mode.unplaced) == len(window.session.project.pairs) > 0
    assert window.banner.isHidden()


def test_the_twin_of_a_landmark_lies_on_the_other_side(qtbot, window):
    pair = own_pair(qtbot, window)
    press(qtbot, window, Qt.Key.Key_M)
    settle(qtbot, window)
    _, twin = window.session.project.pairs
    assert window.selection.ids == (twin.id,)
    for role, brain in (("source", "source"), ("target", "target")):
        frame = getattr(window.session.results, brain).frame
        here, there = (frame.coordinates(np.array(getattr(p, role)))[0] for p in (pair, twin))
        assert here * there < 0


def test_a_muted_landmark_does_not_pull_and_keeps_its_weight(qtbot, window):
    pair = own_pair(qtbot, window)
    pulled = window.session.results.registration.surface.vertices
    model = window.landmarks.model
    index = model.index(model.ids.index(pair.id), Column.NAME)
    model.setData(index, Qt.CheckState.Unchecked.value, Qt.ItemDataRole.CheckStateRole)
    settle(qtbot, window)
    assert window.session.project.muted == (pair.id,)
    assert window.session.project.pairs == (pair,)
    muted = window.session.results.registration.surface.vertices
    assert not np.array_equal(muted, pulled)
    press(qtbot, window, Qt.Key.Key_U)
    settle(qtbot, window)
    np.testing.assert_array_equal(window.session.results.registration.surface.vertices, pulled)


def test_solo_leaves_the_selected_landmarks_and_the_corners(qtbot, window):
    window.selection.select(["upper-02"])
    press(qtbot, window, Qt.Key.Key_S)
    settle(qtbot, window)
    acting = {mark.pair.id for mark in window.session.results.landmarks if mark.weight > 0}
    assert acting == {"upper-02", *(i for i in acting if i.startswith("corner"))}
    assert len(acting) == 5
    press(qtbot, window, Qt.Key.Key_S)
    settle(qtbot, window)
    assert window.session.project.solo == ()


def test_everything_near_a_landmark_is_weighted_together(qtbot, window):
    mark = front_mark(window)
    window.selection.select([mark.pair.id])
    bar = window.landmarks.neighbourhood
    bar.reach.setValue(60)
    assert bar.place.currentText() == SELECTED
    qtbot.mouseClick(bar.buttons[1], LEFT)
    near = {
        other.pair.id: other.pair.weight
        for other in window.session.results.landmarks
        if np.linalg.norm(other.target_point - mark.target_point) <= 60
    }
    assert set(window.selection.ids) == set(near)
    weights = window.session.project.weights
    assert {i: weights[i] for i in near} == pytest.approx(
        {i: 2 * w for i, w in near.items()}, rel=0.01
    )
    assert window.session.undo_stack.count() == 1
    settle(qtbot, window)


def test_what_was_selected_near_a_landmark_is_what_its_weights_are_doubled_of(qtbot, window):
    mark = front_mark(window)
    window.selection.select([mark.pair.id])
    bar = window.landmarks.neighbourhood
    bar.reach.setValue(60)
    qtbot.mouseClick(bar.buttons[0], LEFT)
    selected = set(window.selection.ids)
    assert window.selection.current == mark.pair.id
    qtbot.mouseClick(bar.buttons[1], LEFT)
    assert set(window.session.project.weights) == selected == set(window.selection.ids)
    settle(qtbot, window)


def test_landmarks_near_a_neuropil_of_a_file_are_selected(qtbot, window, tmp_path, monkeypatch):
    mark = front_mark(window)
    path = tmp_path / "AL_L.stl"
    asked = []

    def choose_second(_parent, _title, _label, items, *_rest):
        asked.append(items)
        return items[1], True

    ball = trimesh.creation.icosphere(2, 10.0)
    ball.apply_translation(mark.target_point)
    ball.export(path)
    monkeypatch.setattr(QInputDialog, "getItem", choose_second)
    answer_file_dialog(path)
    window.actions_by_name["neuropils"].trigger()
    assert asked == [["source: source.ply", "target: target.ply"]]
    assert len(window.session.project.neuropils) == 1
    bar = window.landmarks.neighbourhood
    assert bar.place.currentText() == "AL_L (target)"  # what was just loaded is meant
    bar.reach.setValue(12)
    qtbot.mouseClick(bar.buttons[0], LEFT)
    assert mark.pair.id in window.selection.ids
    settle(qtbot, window)


def test_landmarks_are_exported_for_bigwarp_and_imported_again(qtbot, window, tmp_path):
    pair, path = own_pair(qtbot, window), tmp_path / "landmarks.csv"
    answer_file_dialog(path)
    window.actions_by_name["export_landmarks"].trigger()
    (row,) = read_landmark_pairs(path)
    assert row.source == pytest.approx(pair.source)
    window.session.edit("forget", edits.remove_pairs(window.session.project, [pair.id]))
    answer_file_dialog(path)
    press(qtbot, window, Qt.Key.Key_I, CONTROL)
    (again,) = window.session.project.pairs
    assert (again.name, again.target) == (pair.name, pytest.approx(pair.target))
    settle(qtbot, window)


def test_landmarks_are_exported_in_the_format_that_is_chosen(qtbot, window, tmp_path):
    pair = own_pair(qtbot, window)
    chosen = {
        "OpenSim Creator, both brains (*.csv)": "pairs.csv",
        "OpenSim Creator, target (*.csv)": "target.csv",
        "Fiji, source (*.points)": "source",  # its ending is added
        "3D Slicer, target (*.mrk.json)": "target",
    }
    for line, name in chosen.items():
        answer_file_dialog(tmp_path / name, line=line)
        window.actions_by_name["export_landmarks"].trigger()
    (both,) = read_landmark_pairs(tmp_path / "pairs.csv")
    assert both.source == pytest.approx(pair.source)
    assert both.target == pytest.approx(pair.target)
    for name, role in (("target.csv", "target"), ("source.points", "source")):
        (one,) = read_landmark_pairs(tmp_path / name, role)
        assert end_of(one, role) == pytest.approx(end_of(both, role))
    assert (tmp_path / "target.mrk.json").exists()


def test_what_a_format_cannot_hold_is_said(qtbot, window, tmp_path):
    own_pair(qtbot, window)
    half_made = edits.add_unplaced(window.session.project, ["later"])
    window.session.edit("add", half_made)
    answer_file_dialog(tmp_path / "a.csv", line="OpenSim Creator, both brains (*.csv)")
    window.actions_by_name["export_landmarks"].trigger()
    said = window.status.currentMessage()
    assert "Exported 1 landmark to" in said
    assert "not placed and left out: 1" in said


def test_a_damaged_file_of_landmarks_is_a_sentence_and_changes_nothing(qtbot, window, tmp_path):
    path = tmp_path / "landmarks.csv"
    path.write_text('"a","true",1,2,3,4,5,x\n')
    window.landmark_commands.import_from(path)
    assert "landmarks.csv" in window.banner.text
    assert window.session.project.pairs == ()


def test_a_wrong_click_stands_out_in_the_table(qtbot, window):
    pair = own_pair(qtbot, window)
    far = np.array(pair.target) + np.array([45.0, -30.0, 0.0])
    wrong = edits.place_pair(window.session.project, pair.id, "target", tuple(far.tolist()))
    window.session.edit("click wrongly", wrong)
    settle(qtbot, window)
    assert pair.id in Judged.of(window.session.results, Judged()).suspicious
    assert text_of(window, pair.id, Column.FORETOLD).startswith("⚠")


def test_the_curve_of_lambda_tells_the_best_and_the_present_one(qtbot, window):
    tip = window.landmarks.curve.toolTip()
    best = window.session.results.judgement.cross_validation.best
    assert f"λ = {best:.3g}" in tip


def test_beside_its_curve_lambda_has_that_of_the_residual_against_bending(qtbot, window):
    panel, session = window.landmarks, window.session
    wrong = pulling_aside(session.results, session.results.landmarks[-1].source_point)
    session.edit("add a wrong click", edits.add_pair(session.project, wrong))
    settle(qtbot, window)
    before = panel.curve.grab().toImage()
    choose(qtbot, panel.curve_choice, "Residual against bending")
    assert panel.curve.grab().toImage() != before
    residual, energy = bending_on_show(panel)
    drag_right(qtbot, panel.smoothing_slider)
    settle(qtbot, window)
    stiffer = bending_on_show(panel)
    assert stiffer[0] > residual
    assert stiffer[1] < energy
    choose(qtbot, panel.curve_choice, "How well landmarks are foretold")
    assert "foretold" in panel.curve.toolTip()


def choose(qtbot, box, text):
    """Choose a line of a box by typing its first letter."""
    qtbot.keyClicks(box, text[0])
    assert box.currentText() == text


def drag_right(qtbot, slider):
    middle = slider.height() // 2
    places = [QPoint(x, middle) for x in range(slider.width() // 2, slider.width() - 20, 10)]
    drag(qtbot, slider, places, lambda: None)


def bending_on_show(panel):
    """Residual and bending energy at the present lambda, as the curve's tip tells them."""
    tip = panel.curve.toolTip()
    found = re.search(r"present λ = .*: residual ([^ ]+) µm, bending (\S+)", tip)
    return float(found[1]), float(found[2])
