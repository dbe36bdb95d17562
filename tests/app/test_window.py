"""The window end to end, on a display: the user's actions are mouse and key events."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from flyreg_core import edits
from flyreg_core.brain_files import open_brain, read_brain
from flyreg_core.project_file import save_project

pytest.importorskip("PySide6")
from flyreg_gui.landmark_table import ID_ROLE, Column
from flyreg_gui.main import INPUT_ERROR, main
from flyreg_gui.panels.landmarks import format_smoothing
from flyreg_gui.panels.weight_column import groove_of
from flyreg_gui.steps import State, Step
from flyreg_gui.views.flat_view import GRID_STEP
from PySide6.QtCore import QPoint, QPointF, QRect, Qt, QTimer
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication, QMessageBox

from tests.app.hands import (
    CONTROL,
    LEFT,
    LONG_MS,
    answer_file_dialog,
    drag,
    drawn,
    open_with_a_pull,
    pixel,
    press,
    pulling_aside,
    settle,
)

pytestmark = [pytest.mark.window, pytest.mark.filterwarnings("default")]


def front_landmark(window):
    """A landmark on the boundary that can be seen in the source view, away from the others."""
    view = window.view_area.source
    for landmark in window.session.results.landmarks:
        position = QPointF(pixel(view.canvas, landmark.source_point))
        if view.landmark_at(position) == landmark.pair.id and landmark.plane:
            return landmark
    raise AssertionError("no landmark can be seen from the front")


def slider_position(slider, share):
    return QPoint(round(6 + share * (slider.width() - 12)), slider.height() // 2)


def row_of(window, identifier):
    model = window.landmarks.table.model()
    return next(
        row for row in range(model.rowCount()) if model.index(row, 0).data(ID_ROLE) == identifier
    )


def answer_message(qtbot, button, seen):
    """Note the text of the next message box and click one of its buttons."""

    def answer():
        box = QApplication.activeModalWidget()
        if not isinstance(box, QMessageBox):
            QTimer.singleShot(20, answer)
            return
        seen.append(box.text() + "\n" + box.informativeText())
        qtbot.mouseClick(box.button(button), LEFT)

    QTimer.singleShot(20, answer)


def test_a_click_on_a_landmark_selects_it_everywhere(qtbot, window):
    area, landmark = window.view_area, front_landmark(window)
    qtbot.mouseClick(area.source.canvas, LEFT, pos=pixel(area.source.canvas, landmark.source_point))
    assert window.selection.ids == (landmark.pair.id,)
    rows = window.landmarks.table.selectionModel().selectedRows()
    assert [index.data(ID_ROLE) for index in rows] == [landmark.pair.id]
    half = next(iter(landmark.plane))
    flat = next(view for view in area.flat_views if view.half == half)
    selected = np.array(window._theme.selected)
    for markers in (flat._markers, area.target._markers, area.registered._markers):
        colors = np.array(markers._polydata.point_data["color"])
        assert (colors == selected).all(axis=1).sum() == 1


def test_a_click_in_a_flat_view_selects_and_esc_clears(qtbot, window):
    flat = window.view_area.anterior
    landmark = next(m for m in window.session.results.landmarks if "anterior" in m.plane)
    place = pixel(flat.canvas, (*landmark.plane["anterior"][1], 0.1))
    qtbot.mouseClick(flat.canvas, LEFT, pos=place)
    assert window.selection.ids == (landmark.pair.id,)
    press(qtbot, window, Qt.Key.Key_Escape)
    assert window.selection.ids == ()


def test_ctrl_adds_to_the_selection_and_the_table_takes_part(qtbot, window):
    table = window.landmarks.table
    first, second = "upper-02", "lower-03"
    for identifier, modifier in ((first, Qt.KeyboardModifier.NoModifier), (second, CONTROL)):
        index = table.model().index(row_of(window, identifier), Column.NAME)
        table.scrollTo(index)
        qtbot.mouseClick(table.viewport(), LEFT, modifier, pos=table.visualRect(index).center())
    assert window.selection.ids == (first, second)
    flat = window.view_area.anterior
    third = next(m for m in window.session.results.landmarks if m.pair.id == "upper-05")
    place = pixel(flat.canvas, (*third.plane["anterior"][1], 0.1))
    qtbot.mouseClick(flat.canvas, LEFT, CONTROL, pos=place)
    assert window.selection.ids == (first, second, "upper-05")
    assert len(table.selectionModel().selectedRows()) == 3


def test_a_drag_turns_all_linked_cameras_and_selects_nothing(qtbot, window):
    area = window.view_area
    before = [view.canvas.renderer.GetActiveCamera().GetPosition() for view in area.surface_views]
    canvas = area.source.canvas
    middle = canvas.rect().center()
    drag(qtbot, canvas, [middle, middle + QPoint(40, 10), middle + QPoint(80, 20)], lambda: None)
    poses = [view.pose() for view in area.surface_views]
    after = [view.canvas.renderer.GetActiveCamera().GetPosition() for view in area.surface_views]
    assert all(not np.allclose(a, b) for a, b in zip(before, after, strict=True))
    for pose in poses[1:]:
        np.testing.assert_allclose(pose.position, poses[0].position, atol=1e-9)
    assert window.selection.ids == ()


def test_the_far_side_is_never_picked(window):
    """Seen from the front and from behind, what is picked faces the camera."""
    view = window.view_area.source
    frame = window.session.results.source.frame
    for turns in (0, 180):
        view.canvas.renderer.GetActiveCamera().Azimuth(turns)
        view.canvas.refresh()
        view.canvas.grabFramebuffer()
        camera = view.canvas.renderer.GetActiveCamera()
        towards = -np.array(camera.GetDirectionOfProjection())
        assert (towards @ frame.anterior > 0) == (turns == 0)
        half = "anterior" if turns == 0 else "posterior"
        other = "posterior" if turns == 0 else "anterior"
        own = {m.pair.id for m in window.session.results.landmarks if m.pair.half == half}
        picked = set()
        for landmark in window.session.results.landmarks:
            position = QPointF(pixel(view.canvas, landmark.source_point))
            picked.add(view.landmark_at(position))
        hidden = {m.pair.id for m in window.session.results.landmarks if m.pair.half == other}
        assert not picked & hidden
        assert own or not picked


def test_dragging_a_weight_in_the_table_moves_the_picture_meanwhile(qtbot, window):
    open_with_a_pull(qtbot, window)
    identifier = front_landmark(window).pair.id
    table, view = window.landmarks.table, window.view_area.registered
    before = drawn(view)
    index = table.model().index(row_of(window, identifier), Column.WEIGHT)
    table.scrollTo(index)
    groove: QRect = groove_of(table.visualRect(index)).toRect()
    # λ large enough that a weight matters
    positions = [
        QPoint(groove.left() + round(share * groove.width()), groove.center().y())
        for share in (0.5, 0.75, 1.0, 0.0)
    ]
    seen = [before]

    def picture_follows():
        qtbot.waitUntil(lambda: not np.array_equal(drawn(view), seen[-1]), timeout=LONG_MS)
        assert window.session.is_in_gesture
        seen.append(drawn(view))

    drag(qtbot, table.viewport(), positions, picture_follows)
    assert len(seen) == 4
    settle(qtbot, window)
    assert window.session.project.weights[identifier] == 0
    assert window.session.undo_stack.count() == 1
    press(qtbot, window, Qt.Key.Key_Z, CONTROL)
    settle(qtbot, window)
    np.testing.assert_array_equal(drawn(view), before)


def test_dragging_lambda_moves_the_picture_and_everything_can_be_undone(qtbot, window, tmp_path):
    open_with_a_pull(qtbot, window)
    view, slider = window.view_area.registered, window.landmarks.smoothing_slider
    first, before = window.session.results.registration.surface.vertices, drawn(view)
    seen = [before]

    def picture_follows():
        qtbot.waitUntil(lambda: not np.array_equal(drawn(view), seen[-1]), timeout=LONG_MS)
        seen.append(drawn(view))

    positions = [slider_position(slider, share) for share in (0.45, 0.7, 0.9, 1.0)]
    drag(qtbot, slider, positions, picture_follows)
    settle(qtbot, window)
    assert window.session.project.smoothing == 100.0
    assert window.session.undo_stack.count() == 1
    assert "λ = 100" in window.landmarks._smoothing_value.text()

    window.selection.select(["upper-02", "upper-05"])
    weight = window.landmarks.weight_slider
    drag(qtbot, weight, [slider_position(weight, s) for s in (0.6, 0.8)], lambda: picture_follows())
    settle(qtbot, window)
    assert window.session.undo_stack.count() == 2

    window.selection.clear()
    assert not weight.isEnabled()
    assert weight.scale.value(weight.value()) == 1.0
    assert "no landmark" in window.landmarks._weight_label.text()

    exported = tmp_path / "registered.ply"
    answer_file_dialog(exported)
    press(qtbot, window, Qt.Key.Key_E, CONTROL)
    qtbot.waitUntil(exported.is_file)
    again = read_brain(open_brain(str(exported), "um"))
    np.testing.assert_array_equal(
        again.vertices, window.session.results.registration.surface.vertices
    )
    np.testing.assert_array_equal(again.faces, window.session.results.source.surface.faces)

    for _ in range(2):
        press(qtbot, window, Qt.Key.Key_Z, CONTROL)
    settle(qtbot, window)
    np.testing.assert_array_equal(window.session.results.registration.surface.vertices, first)
    np.testing.assert_array_equal(drawn(view), before)
    press(qtbot, window, Qt.Key.Key_Y, CONTROL)
    assert window.session.project.smoothing == 100.0


def test_landmark_mode_makes_a_pair_of_two_clicks_and_delete_removes_it(qtbot, window):
    area = window.view_area
    places = []
    for view, canvas in ((area.source, area.source.canvas), (area.target, area.target.canvas)):
        center = canvas.rect().center() - QPoint(canvas.width() // 8, canvas.height() // 20)
        assert view.point_at(QPointF(center)) is not None
        places.append((canvas, center))
    press(qtbot, window, Qt.Key.Key_Space)
    assert window.mode.is_on
    qtbot.mouseClick(places[0][0], LEFT, pos=places[0][1])
    (begun,) = window.session.project.pairs
    assert (begun.source is None, begun.target is None) == (False, True)
    press(qtbot, window, Qt.Key.Key_Escape)
    assert window.session.project.pairs == ()
    qtbot.mouseClick(places[1][0], LEFT, pos=places[1][1])
    assert window.session.project.pairs[0].source is None
    qtbot.mouseClick(places[0][0], LEFT, pos=places[0][1])
    (pair,) = window.session.project.pairs
    assert pair.is_placed
    assert pair.kind == "interior"
    assert window.selection.ids == (pair.id,)
    settle(qtbot, window)
    landmark = next(m for m in window.session.results.landmarks if m.pair.id == pair.id)
    surface = window.session.results.source.surface
    nearest = np.linalg.norm(surface.vertices - landmark.source_point, axis=1).min()
    assert nearest < 12
    press(qtbot, window, Qt.Key.Key_Space)
    assert not window.mode.is_on
    press(qtbot, window, Qt.Key.Key_Delete)
    assert window.session.project.pairs == ()
    settle(qtbot, window)


def test_delete_sets_landmarks_on_the_boundary_to_weight_0(qtbot, window):
    window.selection.select(["upper-02"])
    press(qtbot, window, Qt.Key.Key_Delete)
    assert window.session.project.weights["upper-02"] == 0
    settle(qtbot, window)


def test_a_suggestion_is_accepted_or_dropped(qtbot, window):
    suggested = [m.pair for m in window.session.results.landmarks if m.pair.origin == "suggested"]
    kept, dropped = suggested[:2]
    assert not window.landmarks.accept_button.isEnabled()
    window.selection.select([kept.id])
    qtbot.mouseClick(window.landmarks.accept_button, LEFT)
    (own,) = window.session.project.pairs
    assert (own.source, own.target, own.origin) == (kept.source, kept.target, "user")
    assert window.session.project.weights[kept.id] == 0
    settle(qtbot, window)
    window.selection.select([dropped.id])
    press(qtbot, window, Qt.Key.Key_Delete)
    assert window.session.project.weights[dropped.id] == 0
    settle(qtbot, window)
    acting = {m.pair.id for m in window.session.results.landmarks if m.pair.weight > 0}
    assert own.id in acting
    assert not {kept.id, dropped.id} & acting


def wavy(window):
    """The project with its suggestions accepted, raised, and laid on a wave across the brain."""
    project, results = window.session.project, window.session.results
    suggested = [mark.pair for mark in results.landmarks if mark.pair.origin == "suggested"]
    project = edits.accept_suggestions(project, suggested)
    for pair in project.pairs:
        x, y, z = pair.target
        place = (x, y + 5 * math.sin(x / 40), z)
        project = edits.place_pair(project, pair.id, "target", place)
    return edits.set_weights(project, [pair.id for pair in project.pairs], 10.0)


def test_the_smoothing_that_cross_validation_speaks_for_is_one_click_away(qtbot, window):
    panel, session = window.landmarks, window.session
    session.edit("lay landmarks on a wave", wavy(window))
    settle(qtbot, window)
    advised = session.results.judgement.cross_validation.best
    assert panel.best_button.text() == f"Take λ = {format_smoothing(advised)}"
    qtbot.mouseClick(panel.best_button, LEFT)
    assert session.project.smoothing == advised
    settle(qtbot, window)
    assert not panel.best_button.isEnabled()
    assert "no other smoothing" in panel.best_button.toolTip()


def test_no_smoothing_is_offered_where_cross_validation_speaks_for_none(window):
    panel, session = window.landmarks, window.session
    advice = session.results.judgement.cross_validation.advise(session.project.smoothing)
    assert advice.smoothing is None  # the demo's landmarks agree
    assert not panel.best_button.isEnabled()
    assert advice.reason in panel.best_button.toolTip()


def test_cancelling_a_preparation_keeps_what_is_on_show(qtbot, window):
    steps, before = window.steps, window.session.results
    qtbot.mouseClick(steps.settings_button, LEFT)
    field = steps.form.source.voxels.lineEdit()
    field.selectAll()
    qtbot.keyClicks(field, "97")
    qtbot.keyClick(field, Qt.Key.Key_Return)
    qtbot.mouseClick(steps.form.apply_button, LEFT)
    assert window.session.project.source.solid.voxels_across == 97
    qtbot.waitUntil(steps.work.cancel_button.isVisible)
    assert steps.cards[Step.PREPARE].report.state is State.RUNNING
    qtbot.mouseClick(steps.work.cancel_button, LEFT)
    qtbot.waitUntil(lambda: not window.session.is_running, timeout=LONG_MS)
    assert window.session.results is before
    assert steps.work.again_button.isVisible()
    assert steps.cards[Step.PREPARE].report.state is State.STALE
    press(qtbot, window, Qt.Key.Key_Z, CONTROL)
    settle(qtbot, window)
    assert window.session.project.source.solid.voxels_across == 36


def test_how_a_brain_lies_is_stated_in_the_settings(qtbot, window):
    steps = window.steps
    assert not window.session.results.source.frame.is_mirrored
    qtbot.mouseClick(steps.settings_button, LEFT)
    pose = steps.form.source.pose
    assert pose.currentText() == "auto"
    pose.setFocus()
    while pose.currentText() != "RVP":  # as it is found, but for left and right
        qtbot.keyClick(pose, Qt.Key.Key_Down)
    qtbot.mouseClick(steps.form.apply_button, LEFT)
    settle(qtbot, window)
    assert window.session.project.source.pose.axes == "RVP"
    assert window.session.results.source.frame.is_mirrored


def test_how_many_vertices_a_brain_has_is_stated_in_the_settings(qtbot, window):
    steps, before = window.steps, window.session.results
    qtbot.mouseClick(steps.settings_button, LEFT)
    field = steps.form.source.vertices
    assert field.text() == ""
    assert field.placeholderText() == str(len(before.source.surface.vertices))
    more = len(before.source.surface.vertices) + 5000
    qtbot.keyClicks(field, str(more))
    qtbot.mouseClick(steps.form.apply_button, LEFT)
    settle(qtbot, window)
    assert window.session.project.source.simplify.vertices == more
    assert 0.95 * more < len(window.session.results.source.surface.vertices) <= more
    assert field.text() == str(more)
    field.selectAll()
    qtbot.keyClick(field, Qt.Key.Key_Delete)
    qtbot.mouseClick(steps.form.apply_button, LEFT)
    settle(qtbot, window)
    assert window.session.project.source.simplify.vertices is None
    np.testing.assert_array_equal(
        window.session.results.source.surface.vertices, before.source.surface.vertices
    )


def test_a_preparation_that_fails_says_why_where_it_failed(qtbot, window):
    steps, before = window.steps, window.session.results
    qtbot.mouseClick(steps.settings_button, LEFT)
    for field, text in ((steps.form.source.right, "-500"), (steps.form.source.left, "-400")):
        qtbot.keyClicks(field, text)
    qtbot.mouseClick(steps.form.apply_button, LEFT)
    qtbot.waitUntil(lambda: window.session.failure is not None, timeout=LONG_MS)
    assert "trim planes" in window.banner.text
    assert steps.cards[Step.PREPARE].report.state is State.FAILED
    assert window.session.results is before


def test_closing_with_unsaved_changes_names_them_and_can_be_called_off(qtbot, window, tmp_path):
    window.selection.select(["upper-02"])
    press(qtbot, window, Qt.Key.Key_Delete)
    settle(qtbot, window)
    seen: list[str] = []
    answer_message(qtbot, QMessageBox.StandardButton.Cancel, seen)
    window.close()
    assert "delete landmark" in seen[0]
    assert window.isVisible()
    saved = tmp_path / "mine.flyreg"
    answer_message(qtbot, QMessageBox.StandardButton.Save, seen)
    QTimer.singleShot(0, lambda: answer_file_dialog(saved))
    window.close()
    assert saved.is_file()
    assert not window.isVisible()


def test_a_saved_project_opens_with_the_same_result(qtbot, window, tmp_path):
    window.selection.select(["upper-02"])
    press(qtbot, window, Qt.Key.Key_Delete)
    settle(qtbot, window)
    vertices = window.session.results.registration.surface.vertices
    saved = tmp_path / "mine.flyreg"
    window.blend.setValue(60)
    window.view_area.source.canvas.turn(QPointF(50, 20))
    window.view_area.source.canvas.camera_moved.emit()
    pose = window.view_area.target.pose()
    answer_file_dialog(saved)
    press(qtbot, window, Qt.Key.Key_S, CONTROL)
    assert window.session.unsaved_changes == []
    window.blend.setValue(10)
    press(qtbot, window, Qt.Key.Key_R)
    answer_file_dialog(saved)
    press(qtbot, window, Qt.Key.Key_O, CONTROL)
    settle(qtbot, window)
    assert window.session.path == saved
    np.testing.assert_array_equal(window.session.results.registration.surface.vertices, vertices)
    assert window.preferences.recent_projects == [saved]
    assert window.blend.value() == 60
    np.testing.assert_allclose(window.view_area.target.pose().position, pose.position)


def test_a_view_can_be_maximised_and_restored(qtbot, window):
    frames = window.view_area.frames
    for expected in (1, 5):
        qtbot.mouseDClick(frames[2].title, LEFT, pos=QPoint(60, 8))
        assert sum(frame.isVisible() for frame in frames) == expected


def colors_in(image, rectangle, scale):
    """The different colours at a grid of places in a part of a picture."""
    return {
        image.pixel(round(x * scale), round(y * scale))
        for x in range(rectangle.left() + 5, rectangle.right() - 5, 9)
        for y in range(rectangle.top() + 5, rectangle.bottom() - 5, 9)
    }


def test_a_click_on_the_heading_puts_the_worst_landmarks_first(qtbot, window):
    table = window.landmarks.table
    heading = table.horizontalHeader()
    middle = heading.sectionViewportPosition(Column.RESIDUAL) + 10
    for _ in range(2):  # the first click puts the best ones first
        qtbot.mouseClick(heading.viewport(), LEFT, pos=QPoint(middle, heading.height() // 2))
    rows = range(table.model().rowCount())
    shown = [table.model().index(row, Column.RESIDUAL).data() for row in rows]
    values = [float(text) for text in shown if text]
    assert values == sorted(values, reverse=True)
    assert values[0] > values[-1]


def test_a_click_on_the_heading_sorts_names_by_the_numbers_in_them(qtbot, window):
    names = ["spot 10", "spot 2", "Spot 1"]
    window.session.edit("add", edits.add_unplaced(window.session.project, names))
    table = window.landmarks.table
    heading = table.horizontalHeader()
    middle = heading.sectionViewportPosition(Column.NAME) + 10
    qtbot.mouseClick(heading.viewport(), LEFT, pos=QPoint(middle, heading.height() // 2))
    rows = range(table.model().rowCount())
    shown = [table.model().index(row, Column.NAME).data() for row in rows]
    assert [name for name in shown if name in names] == ["Spot 1", "spot 2", "spot 10"]


def test_the_grid_on_a_flat_half_is_bent_as_the_spline_bends_the_plane(qtbot, window):
    view = window.view_area.anterior
    straight = view._lines.points(window.session.results.source.halves["anterior"].plane)
    away = np.abs((straight + np.array([1.5, 1.0])) / GRID_STEP % 1 - 0.5).max(axis=1)
    np.testing.assert_allclose(away, 0.5, atol=1e-6)  # each on a line of the rectangle's grid
    before = np.array(view._grid._polydata.points)
    assert view._grid.actor.GetVisibility()
    mark = next(m for m in window.session.results.landmarks if "suggested-anterior" in m.pair.id)
    mine = pulling_aside(window.session.results, mark.source_point)
    window.session.edit("add mine", edits.add_pair(window.session.project, mine))
    settle(qtbot, window)
    bent = view._lines.points(window.session.results.registration.halves["anterior"].plane)
    np.testing.assert_allclose(np.array(view._grid._polydata.points)[:, :2], bent, atol=1e-6)
    assert np.abs(np.array(view._grid._polydata.points) - before).max() > 0.01


def test_the_picture_of_the_window_shows_all_views(window):
    image = window.picture().toImage()
    for frame in window.view_area.frames:
        canvas = frame.canvas
        place = QRect(canvas.mapTo(window, QPoint(0, 0)), canvas.size())
        assert len(colors_in(image, place, image.width() / window.width())) > 50


def test_the_screenshot_option_registers_writes_and_ends(qapp, project, tmp_path):
    save_project(project, tmp_path / "p.flyreg")
    picture = tmp_path / "new folder" / "window.png"
    assert main([str(tmp_path / "p.flyreg"), "--screenshot", str(picture)]) == 0
    image = QImage(str(picture))
    assert image.width() >= 1000
    middle = QRect(
        image.width() // 4, image.height() // 10, image.width() // 2, image.height() // 2
    )
    assert len(colors_in(image, middle, 1)) > 200


def test_the_screenshot_option_complains_of_bad_input(qapp, project, tmp_path, capsys):
    picture = tmp_path / "window.png"
    assert main(["nowhere.ply", "nothing.ply", "--screenshot", str(picture)]) == INPUT_ERROR
    assert "nowhere.ply" in capsys.readouterr().err
    trim = replace(project.source.trim, right=-500.0, left=-400.0)
    save_project(replace(project, source=replace(project.source, trim=trim)), tmp_path / "p.flyreg")
    assert main([str(tmp_path / "p.flyreg"), "--screenshot", str(picture)]) == INPUT_ERROR
    complaint = capsys.readouterr().err
    assert "trim planes" in complaint
    assert "Traceback" not in complaint
    assert not picture.exists()


def test_drawing_leaves_the_meshes_as_they_are(window, project, pipeline):
    fresh = pipeline.run(project)
    shown = window.session.results
    for mesh in (shown.source.surface, shown.target.surface, shown.registration.surface):
        assert not mesh.vertices.flags.writeable
    np.testing.assert_array_equal(
        fresh.registration.surface.vertices, shown.registration.surface.vertices
    )


def test_the_empty_window_invites(qtbot, empty_window):
    start = empty_window.start
    assert start.isVisible()
    assert all(b.isVisible() for b in (start.open_button, start.project_button, start.demo_button))
    assert not empty_window.actions_by_name["export"].isEnabled()
    assert empty_window.windowTitle() == "flyreg"


def test_smoothing_is_shown_whoever_changed_it(qtbot, window):
    window.session.edit("x", replace(window.session.project, smoothing=0.5))
    assert window.landmarks.smoothing_slider.scale.value(
        window.landmarks.smoothing_slider.value()
    ) == pytest.approx(0.5, rel=0.05)
    settle(qtbot, window)


def test_a_closed_window_holds_nothing_that_qt_has_deleted(window):
    """A wrapper that outlives its OpenGL surface would be taken for the next object there."""
    canvases = [frame.canvas for frame in window.view_area.frames]
    assert all(canvas._surface is not None for canvas in canvases if canvas.isVisible())
    window.session.undo_stack.setClean()
    window.close()
    assert [canvas for canvas in canvases if canvas._surface or canvas._ctx] == []
