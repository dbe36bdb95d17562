"""Taking results away from the window: points carried along, vertex pairs for navis."""

import csv

import numpy as np
import pytest

from flyreg_core.transform import carry

pytest.importorskip("PySide6")
from tests.app.hands import answer_file_dialog


@pytest.mark.parametrize("is_inverse", [False, True])
def test_points_of_a_table_are_carried_as_the_command_does(window, tmp_path, is_inverse):
    results = window.session.results
    brain = results.target if is_inverse else results.source
    points = brain.surface.vertices[::4000] + np.array([0.5, 0.0, 0.0])
    start, end = tmp_path / "points.csv", tmp_path / "carried.csv"
    rows = "".join(f"{x!r},{y!r},{z!r},kept\n" for x, y, z in points.tolist())
    start.write_text("x,y,z,note\n" + rows + "9999,0,0,far\n")
    answer_file_dialog(start, end)
    name = "carry_points_back" if is_inverse else "carry_points"
    window.actions_by_name[name].trigger()
    table = list(csv.DictReader(end.read_text().splitlines()))
    assert [row["status"] for row in table] == ["mapped"] * len(points) + ["outside"]
    assert {row["note"] for row in table} == {"kept", "far"}
    found = np.array([[float(row[axis]) for axis in "xyz"] for row in table[:-1]])
    assert found == pytest.approx(carry(points, results, is_inverse=is_inverse).points)


def test_vertex_pairs_are_written_for_other_programs(window, tmp_path):
    path = tmp_path / "pairs.csv"
    answer_file_dialog(path)
    window.actions_by_name["export_vertex_pairs"].trigger()
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    source, moved = (
        window.session.results.source.surface,
        window.session.results.registration.surface,
    )
    away = np.linalg.norm(source.vertices[:, None] - rows[None, :5, :3], axis=2)
    assert moved.vertices[away.argmin(axis=0)] == pytest.approx(rows[:5, 3:])


def test_a_table_without_coordinates_is_a_sentence(window, tmp_path):
    start = tmp_path / "points.csv"
    start.write_text("a,b\n1,2\n")
    answer_file_dialog(start, tmp_path / "out.csv")
    window.actions_by_name["carry_points"].trigger()
    assert "has no column x" in window.banner.text
    assert not (tmp_path / "out.csv").exists()
