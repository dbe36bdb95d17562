from dataclasses import replace

import pytest

from flyreg_core import edits
from flyreg_core.landmarks import LandmarkPair

pytest.importorskip("PySide6")
from flyreg_gui.landmark_table import ID_ROLE, Column, LandmarkTable, format_weight
from PySide6.QtCore import QModelIndex, Qt


@pytest.fixture
def table(qapp, qtmodeltester, project, results):
    table = LandmarkTable()
    table.show(project, results)
    return table


def text(table, row, column):
    return table.data(table.index(row, column))


def row_of(table, identifier):
    return table.ids.index(identifier)


def test_the_model_keeps_the_rules_of_qt(table, qtmodeltester):
    qtmodeltester.check(table)


def test_each_landmark_has_a_row(table, results):
    assert table.rowCount() == len(results.landmarks)
    assert table.rowCount(table.index(0, 0)) == 0
    assert set(table.ids) == {landmark.pair.id for landmark in results.landmarks}


def test_residuals_and_left_out_errors_are_those_of_the_registration(table, results):
    known = {
        Column.RESIDUAL: results.registration.residual_um,
        Column.FORETOLD: results.judgement.leave_one_out_um,
    }
    for column, values in known.items():
        for identifier, value in values.items():
            shown = text(table, row_of(table, identifier), column).removeprefix("⚠ ")
            assert float(shown) == pytest.approx(value, abs=0.006)
    shares = results.judgement.leverage
    for identifier, share in shares.items():
        shown = text(table, row_of(table, identifier), Column.LEVERAGE)
        assert float(shown) == pytest.approx(100 * share, abs=0.51)


def test_a_large_error_is_written_without_decimals_so_that_it_fits(table, results):
    far = {identifier: 123.456 for identifier in table.ids}
    judgement = replace(results.judgement, leave_one_out_um=far)
    table.show(results.project, replace(results, judgement=judgement))
    assert text(table, 0, Column.FORETOLD).endswith("123")


def test_a_weight_is_shown_before_the_results_have_it(table, project, results):
    table.show(edits.set_weight(project, "upper-02", 4.0), results)
    row = row_of(table, "upper-02")
    assert text(table, row, Column.WEIGHT) == "4"
    tip = table.data(table.index(row, Column.WEIGHT), Qt.ItemDataRole.ToolTipRole)
    assert "W⁻¹ entry 0.25" in tip


def test_weight_0_is_off(table, project, results):
    table.show(edits.set_weight(project, "upper-02", 0.0), results)
    assert text(table, row_of(table, "upper-02"), Column.WEIGHT) == "off"
    assert format_weight(0.0) == "off"


def test_a_changed_weight_keeps_the_rows(table, project, results, qtbot):
    with qtbot.assertNotEmitted(table.modelReset), qtbot.waitSignal(table.dataChanged):
        table.show(edits.set_weight(project, "upper-02", 4.0), results)


def test_a_new_pair_has_a_row_before_its_residual_is_known(table, project, results):
    place = (0.0, 0.0, 0.0)
    pair = LandmarkPair("user-1", "calyx", "interior", None, place, place)
    table.show(edits.add_pair(project, pair), results)
    row = row_of(table, "user-1")
    assert text(table, row, Column.NAME) == "calyx"
    assert text(table, row, Column.RESIDUAL) == ""
    assert table.flags(table.index(row, Column.NAME)) & Qt.ItemFlag.ItemIsEditable
    table.show(project, results)
    assert "user-1" not in table.ids


def test_names_on_the_boundary_cannot_be_edited(table):
    index = table.index(0, Column.NAME)
    assert not table.flags(index) & Qt.ItemFlag.ItemIsEditable
    assert table.data(index, ID_ROLE) == table.ids[0]


def test_there_is_nothing_without_a_project(qapp):
    table = LandmarkTable()
    table.show(None, None)
    assert table.rowCount() == 0
    assert table.data(QModelIndex()) is None
