import os
import subprocess
import sys
from pathlib import Path

import igl
import numpy as np
import pytest

from flyreg_core.brain_files import open_brain, read_brain
from flyreg_core.winding_number import winding_numbers
from tests.shapes import sphere

CHECKOUT = Path(__file__).parents[2]
NEAR = 5e-3
"""How far expansions may be from the sum of all solid angles."""


def around(vertices, count=3000):
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    return np.random.default_rng(0).uniform(
        1.5 * low - 0.5 * high, 1.5 * high - 0.5 * low, (count, 3)
    )


@pytest.mark.parametrize("name", ["FLYWIRE_whole_brain", "T1"])
def test_a_brain_with_sheets_and_holes_winds_as_the_sum_of_all_its_solid_angles(name):
    mesh = read_brain(open_brain(name))
    points = around(mesh.vertices)
    exact = igl.winding_number(mesh.vertices, mesh.faces, points)
    assert winding_numbers(points, mesh.vertices, mesh.faces) == pytest.approx(exact, abs=NEAR)


@pytest.mark.parametrize("rounds", [0, 3, 5])
def test_a_closed_surface_winds_once_around_its_inside_and_not_around_the_outside(rounds):
    vertices, faces = sphere(100.0, rounds)
    points = around(vertices)
    away = np.linalg.norm(points, axis=1)
    is_clear = (away < 55) | (away > 101)  # the coarsest has its faces 58 from the middle
    expected = (away < 55).astype(float)[is_clear]
    assert winding_numbers(points[is_clear], vertices, faces) == pytest.approx(expected, abs=NEAR)


def test_a_surface_turned_inside_out_winds_the_other_way():
    vertices, faces = sphere()
    points = around(vertices)
    found = winding_numbers(points, vertices, faces)
    assert winding_numbers(points, vertices, faces[:, ::-1]) == pytest.approx(-found, abs=1e-9)


def test_faces_without_area_count_nothing():
    vertices, faces = sphere()
    points = around(vertices)
    more = np.vstack([faces, faces[:40, [0, 1, 1]], faces[:40, [2, 2, 2]]])
    expected = winding_numbers(points, vertices, faces)
    assert winding_numbers(points, vertices, more) == pytest.approx(expected, abs=NEAR)


@pytest.mark.parametrize("count", [1, 2, 7])
def test_few_points_are_asked_as_many_are_and_on_a_line_too(count):
    vertices, faces = sphere()
    points = np.outer(np.linspace(10.0, 150.0, count), [1.0, 0.0, 0.0])
    expected = (np.linalg.norm(points, axis=1) < 100).astype(float)
    assert winding_numbers(points, vertices, faces) == pytest.approx(expected, abs=NEAR)


def test_the_expansion_of_one_far_face_is_exact_to_the_third_order():
    vertices = np.array([[0.0, 0.0, 0.0], [3.0, 0.5, 0.0], [1.0, 2.0, 1.0]])
    faces = np.array([[0, 1, 2]])
    direction = np.array([1.0, 2.0, 2.0]) / 3
    errors = []
    for away in (40.0, 80.0, 160.0):
        point = vertices.mean(axis=0) + away * direction[None]
        exact = igl.winding_number(vertices, faces, point)[0]
        errors.append(abs(winding_numbers(point, vertices, faces)[0] / exact - 1))
    assert errors[0] < 1e-4
    assert errors[1] < errors[0] / 6
    assert errors[2] < errors[1] / 6


def test_what_is_compiled_now_rounds_as_what_was_kept_when_it_was_compiled(tmp_path):
    """Else the first registration of a new installation would not be that of all later ones."""
    program = (
        "import hashlib\n"
        "import sys\n"
        "from flyreg_core.winding_number import winding_numbers\n"
        "from tests.core.test_winding_number import around\n"
        "from tests.shapes import sphere\n"
        "vertices, faces = sphere(100.0, 4)\n"
        "found = winding_numbers(around(vertices), vertices, faces)\n"
        "sys.stdout.write(hashlib.sha256(found.tobytes()).hexdigest())\n"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(CHECKOUT)}
    command = [sys.executable, "-c", program]
    first, second = (
        subprocess.run(command, env=environment, capture_output=True, check=True).stdout
        for _ in range(2)
    )
    assert len(first) > 0
    assert first == second
