"""Each rival solves the kind of pair that it is made for, or comparing with it would be idle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flyreg_core.affine import AffineMap
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.progress import ignore
from flyreg_core.rivals.normal_distributions import find_distributions
from flyreg_core.rivals.rival import Rival
from flyreg_core.rivals.table import RIVAL_OF, RIVALS
from flyreg_core.rivals.unmoved import leave
from flyreg_core.surface_distance import measure_distances
from tests.shapes import sphere

MOST_LEFT = 0.01
"""Of the movement, on average over the vertices."""


def bumpy(rounds: int = 4) -> SurfaceMesh:
    """Closed, of the size of a brain, the same in no two directions."""
    vertices, faces = sphere(1.0, rounds)
    x, y, z = vertices.T
    radius = 1 + 0.2 * np.sin(3 * x + 1) * np.cos(2 * y) + 0.15 * np.sin(4 * z + 2 * x)
    return SurfaceMesh(radius[:, np.newaxis] * vertices * [250.0, 140.0, 90.0], faces)


def turned(degrees: float, scale: float = 1.0) -> AffineMap:
    """A turn about a slanting axis, a shift of 10 micrometres, and a size."""
    axis = np.array([1.0, 2.0, 2.0]) / 3
    x, y, z = axis
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    turn = np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * across @ across
    return AffineMap(scale * turn, np.array([6.0, -6.0, 5.0]))


def bent(points: Floats) -> Floats:
    """A smooth movement by 12 micrometres or less."""
    x, y, z = (points / 100).T
    return points + 7 * np.stack([np.sin(y + z), np.cos(x) * np.sin(z), np.sin(x + 1)], axis=1)


def left(name: str, source: SurfaceMesh, movement: AffineMap) -> float:
    """Return which share of a movement a rival has left undone, vertex by vertex."""
    target = SurfaceMesh(movement(source.vertices), source.faces)
    moved = RIVAL_OF[name].run(source, target, ignore)
    away = np.linalg.norm(moved.vertices - target.vertices, axis=1)
    return float(away.mean() / np.linalg.norm(source.vertices - target.vertices, axis=1).mean())


@pytest.mark.parametrize("name", ["icp-rigid", "icp-similarity", "icp-affine", "cpd-rigid"])
def test_rivals_undo_a_turn_and_a_shift(name: str) -> None:
    assert left(name, bumpy(3), turned(3.0)) < MOST_LEFT


@pytest.mark.parametrize("name", ["icp-plane", "ndt"])
def test_rivals_that_see_the_surface_undo_a_larger_turn_where_vertices_are_dense(name: str) -> None:
    assert left(name, bumpy(5), turned(6.0)) < MOST_LEFT


@pytest.mark.parametrize("name", ["icp-similarity", "icp-affine", "cpd-rigid"])
def test_rivals_that_scale_undo_another_size(name: str) -> None:
    assert left(name, bumpy(3), turned(2.0, 1.04)) < MOST_LEFT


@pytest.mark.parametrize("name", ["icp-affine", "cpd-affine"])
def test_affine_rivals_undo_a_shear(name: str) -> None:
    shear = AffineMap(np.array([[1.03, 0.02, 0], [0, 0.97, 0.02], [0.02, 0, 1.04]]), np.ones(3))
    assert left(name, bumpy(3), shear.after(turned(2.0))) < MOST_LEFT


@pytest.mark.parametrize(
    ("name", "fewer", "most_left"),
    [
        ("cpd-nonrigid", {"count": 600}, MOST_LEFT),
        ("cpd-low-rank", {"count": 1500, "rank": 200}, MOST_LEFT),
        ("nricp", {}, 0.08),  # its package's last step is still stiff; softer ones leave 5 %
    ],
)
def test_bending_rivals_undo_a_bend(name: str, fewer: dict[str, int], most_left: float) -> None:
    """By distances between surfaces: how far points slide along them, none of these can know."""
    source = bumpy()
    target = SurfaceMesh(bent(source.vertices), source.faces)
    run: Any = RIVAL_OF[name].run
    moved = getattr(run, "func", run)(source, target, ignore, **fewer)
    assert apart(source.moved(moved.vertices), target) < most_left * apart(source, target)
    # points beside the surface go along with it
    beside = source.vertices + 2 * source.vertex_normals
    gone = np.linalg.norm(moved.carry(beside) - moved.vertices, axis=1)
    assert np.abs(gone - 2).mean() < 0.3


def apart(a: SurfaceMesh, b: SurfaceMesh) -> float:
    return measure_distances(a, b, ignore, 4000).a_to_b.mean_um


def test_without_registration_nothing_moves() -> None:
    source = bumpy(2)
    for name in ("none", "alignment"):
        moved = RIVAL_OF[name].run(source, source, ignore)
        assert moved.vertices is source.vertices
        assert moved.carry(source.vertices) is source.vertices


def test_every_rival_has_a_name_and_a_description_of_its_own() -> None:
    assert len(RIVAL_OF) == len(RIVALS) == len({rival.description for rival in RIVALS})


def test_a_grid_of_too_few_points_has_no_distributions() -> None:
    assert find_distributions(bumpy(2).vertices, 1.0) is None


def test_distributions_are_those_of_the_points_in_each_cell() -> None:
    points = np.random.default_rng(5).normal(size=(400, 3)) * [5.0, 2.0, 1.0] + 40
    grid = find_distributions(points, 100.0)
    assert grid is not None
    assert np.allclose(grid.means, points.mean(axis=0))
    assert np.allclose(np.linalg.inv(grid.precisions[0]), np.cov(points.T))


def test_a_rival_whose_package_is_missing_says_so_without_being_run() -> None:
    there, missing = (Rival("", "", leave, package=name) for name in ("trimesh", "no_such_package"))
    assert there.lacking == ""
    assert missing.lacking == (
        "needs the package no_such_package; install flyreg[rivals] to have it"
    )
