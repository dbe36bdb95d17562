"""Tables of points: columns in and out, rows in order, bad rows named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flyreg_core.errors import InputError
from flyreg_core.point_files import read_points, write_points
from flyreg_core.transform import TransformedPoints


def table(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "points.csv"
    path.write_text(text)
    return path


def test_coordinates_are_found_by_the_names_of_their_columns(tmp_path: Path) -> None:
    read = read_points(table(tmp_path, "name,z,x,y\na,3,1,2\nb,6,4,5\n"))
    assert read.points.tolist() == [[1, 2, 3], [4, 5, 6]]


def test_other_columns_and_the_order_of_rows_are_kept(tmp_path: Path) -> None:
    read = read_points(table(tmp_path, "name,z,x,y\na,3,1,2\n'b, c',6,4,5\n".replace("'", '"')))
    moved = TransformedPoints(np.array([[7.0, 8, 9], [np.nan] * 3]), np.array([True, False]))
    write_points(tmp_path / "out.csv", read, moved, unit_um=1.0)
    assert (tmp_path / "out.csv").read_text().splitlines() == [
        "x,y,z,name,status",
        "7.0,8.0,9.0,a,mapped",
        ',,,"b, c",outside',
    ]


def test_coordinates_are_written_in_the_unit_asked_for(tmp_path: Path) -> None:
    read = read_points(table(tmp_path, "x,y,z\n1,2,3\n"))
    moved = TransformedPoints(np.array([[1.0, 2, 4]]), np.array([True]))
    write_points(tmp_path / "out.csv", read, moved, unit_um=1e-3)
    again = read_points(tmp_path / "out.csv")
    assert np.allclose(again.points, [[1000, 2000, 4000]])


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("x,y\n1,2\n", "no column z"),
        ("", "is empty"),
        ("name\na\n", "no column x and no column y and no column z"),
        ("x,y,z\n1,2,\n", "row 1, column z: '' is not a number"),
        ("x,y,z\n1,2,3\n1,two,3\n", "row 2, column y: 'two' is not a number"),
        ("x,y,z\n1,inf,3\n", "row 1, column y: 'inf' is not a number"),
        ("x,y,z\n1,2\n", "row 1: 2 values for 3 columns"),
    ],
)
def test_what_is_wrong_with_a_table_is_said_with_its_place(
    tmp_path: Path, text: str, sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        read_points(table(tmp_path, text))
