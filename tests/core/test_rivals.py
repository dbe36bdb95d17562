"""Each rival solves the kind of pair that it is made for, or comparing with it would be idle."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from flyreg_core.affine import AffineMap
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.progress import ignore
from flyreg_core.rivals.bending_mesh import ROUNDS
from flyreg_core.rivals.normal_distributions import find_distributions
from flyreg_core.rivals.rival import Moved, Rival
from flyreg_core.rivals.table import RIVAL_OF, RIVALS
from flyreg_core.rivals.unmoved import leave
from flyreg_core.surface_distance import measure_distances
from flyreg_core.surface_places import find_places
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


TURN, LARGER_TURN, OTHER_SIZE = turned(3.0), turned(6.0), turned(2.0, 1.04)
SHEAR = AffineMap(np.array([[1.03, 0.02, 0], [0, 0.97, 0.02], [0.02, 0, 1.04]]), np.ones(3)).after(
    turned(2.0)
)
MUST_UNDO = {
    "icp-rigid": (TURN,),
    "icp-similarity": (TURN, OTHER_SIZE),
    "icp-affine": (TURN, OTHER_SIZE, SHEAR),
    "icp-plane": (LARGER_TURN,),
    "ndt": (LARGER_TURN,),
    "cpd-rigid": (TURN, OTHER_SIZE),
    "cpd-affine": (TURN, OTHER_SIZE, SHEAR),
    "cpd-nonrigid": (TURN, OTHER_SIZE, SHEAR),
    "cpd-low-rank": (TURN, OTHER_SIZE, SHEAR),
    "nricp": (TURN, OTHER_SIZE, SHEAR),
}
SEE_THE_SURFACE = ("icp-plane", "ndt")
"""These want dense vertices: they are not drawn to the very vertex from which each came."""
BENDING = ("cpd-nonrigid", "cpd-low-rank", "nricp")
FEWER: dict[str, dict[str, Any]] = {
    "cpd-nonrigid": {"count": 600},
    "cpd-low-rank": {"count": 1500, "rank": 200},
    "nricp": {"rounds": (replace(ROUNDS[0], vertices=600), ROUNDS[1])},
}
"""Points of those that take long."""


def moved_by_rival(name: str, source: SurfaceMesh, target: SurfaceMesh) -> Moved:
    run: Any = RIVAL_OF[name].run
    if name in FEWER:
        run = partial(getattr(run, "func", run), **FEWER[name])
    moved: Moved = run(source, target, ignore)
    return moved


def left(name: str, source: SurfaceMesh, movement: AffineMap) -> float:
    """Return which share of a movement a rival has left undone, vertex by vertex."""
    target = SurfaceMesh(movement(source.vertices), source.faces)
    away = np.linalg.norm(moved_by_rival(name, source, target).vertices - target.vertices, axis=1)
    return float(away.mean() / np.linalg.norm(source.vertices - target.vertices, axis=1).mean())


@pytest.mark.parametrize(
    ("name", "movement"), [(name, each) for name, moves in MUST_UNDO.items() for each in moves]
)
def test_rivals_undo_what_they_can_move_by(name: str, movement: AffineMap) -> None:
    source = bumpy(5 if name in SEE_THE_SURFACE else 3)
    assert left(name, source, movement) < MOST_LEFT


def test_no_rival_goes_untried() -> None:
    assert {"none", "alignment", *MUST_UNDO} == set(RIVAL_OF)


@pytest.mark.parametrize("name", BENDING)
def test_bending_rivals_undo_a_bend(name: str) -> None:
    """By distances from the target's surface: how far points slide along it, none of these can know.

    Of the vertices, as they are what is moved. Between both surfaces the faces count too, and those
    of vertices that have slid cut corners elsewhere than the target's own: here by 9 %.
    """
    source = bumpy()
    target = SurfaceMesh(bent(source.vertices), source.faces)
    moved = moved_by_rival(name, source, target)
    off, off_before = (
        find_places(each, target).apart_um.mean() for each in (moved.vertices, source.vertices)
    )
    assert off < MOST_LEFT * off_before
    if name != "nricp":  # it alone slides
        assert apart(source.moved(moved.vertices), target) < MOST_LEFT * apart(source, target)
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
    there, missing = (
        Rival("", "", "", leave, package=name) for name in ("trimesh", "no_such_package")
    )
    assert there.lacking == ""
    assert missing.lacking == (
        "needs the package no_such_package; install flyreg[rivals] to have it"
    )
