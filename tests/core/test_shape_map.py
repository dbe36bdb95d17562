from dataclasses import replace

import numpy as np
import pytest
from flyreg_resources.demo import deform

from flyreg_core.affine import AffineMap
from flyreg_core.alignment import align
from flyreg_core.brain_files import open_brain, read_brain
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.pose import find_frame
from flyreg_core.progress import ignore
from flyreg_core.shape_map import (
    ALONG,
    LEAST_VOLUME,
    STRAIN,
    _pulls,
    _solve,
    _strain_energy,
    fit_shape_map,
)

IDENTITY = AffineMap(np.eye(3), np.zeros(3))


@pytest.fixture(scope="module")
def source(demo_source):
    return demo_source.original


@pytest.fixture(scope="module")
def target(demo_target):
    return demo_target.original


@pytest.fixture(scope="module")
def shape_map(demo_shape_map):
    return demo_shape_map


def test_it_finds_most_of_a_known_deformation(source, shape_map):
    """The demo's target is its source, deformed by a known map."""
    truth = deform(source.vertices)
    before = np.linalg.norm(source.vertices - truth, axis=1).mean()
    after = np.linalg.norm(shape_map(source.vertices) - truth, axis=1).mean()
    assert after < 0.25 * before


def test_it_can_be_gone_back(source, shape_map):
    there = shape_map(source.vertices)
    assert np.abs(shape_map.back(there) - source.vertices).max() < 1e-5


def test_it_can_be_gone_back_where_space_is_stretched_threefold(source, shape_map):
    """Steps that take no slope into account swing ever wider there."""
    stretching = np.zeros_like(shape_map.coefficients)
    stretching[1:4] = 2 * shape_map.basis.scale * np.eye(3)
    stretching[4:] = shape_map.coefficients[4:]
    stretched = replace(shape_map, coefficients=stretching)
    there = stretched(source.vertices)
    assert np.abs(stretched.back(there) - source.vertices).max() < 1e-5


def test_space_does_not_fold_where_the_target_lacks_the_lobes():
    """IS2 ends where the optic lobes of FCWB begin; these have next to nothing to lie on."""
    whole, cropped = (read_brain(open_brain(name)) for name in ("FCWB", "IS2"))
    start = align(whole, cropped, find_frame(whole), find_frame(cropped), ignore).to_target
    found = fit_shape_map(whole, cropped, start)
    points = whole.vertices[::10]
    sides = [found(points + step) - found(points) for step in np.eye(3)]
    volume = np.linalg.det(np.stack(sides, axis=1)) / np.linalg.det(found.similarity.matrix)
    assert volume.min() > 0.5 * LEAST_VOLUME
    assert np.abs(found.back(found(points)) - points).max() < 1e-5


def test_normals_turn_with_the_surface(source, shape_map):
    moved = SurfaceMesh(shape_map(source.vertices), source.faces)
    turned = shape_map.turned(source.vertices, source.vertex_normals)
    likeness = (turned * moved.vertex_normals).sum(axis=1)
    assert np.quantile(likeness, 0.05) > 0.95


def test_a_moved_brain_is_moved_back(source):
    angle = 0.3
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    moved = SurfaceMesh(1.2 * source.vertices @ turn.T + [10, 20, 30], source.faces)
    found = fit_shape_map(moved, source, AffineMap(1.2 * turn, np.array([10.0, 20, 30])).inverse())
    assert np.linalg.norm(found(moved.vertices) - source.vertices, axis=1).mean() < 1


def test_a_mirror_image_is_mirrored_back(source):
    mirror = AffineMap(np.diag([-1.0, 1.0, 1.0]), np.zeros(3))
    moved = SurfaceMesh(mirror(source.vertices), source.faces[:, ::-1])
    found = fit_shape_map(moved, source, mirror)
    assert np.linalg.norm(found(moved.vertices) - source.vertices, axis=1).mean() < 1
    turned = found.turned(moved.vertices, moved.vertex_normals)
    likeness = (turned * source.vertex_normals).sum(axis=1)
    assert np.quantile(likeness, 0.05) > 0.95


def test_combining_functions_gives_what_the_table_of_their_values_gives(source, shape_map):
    basis, rng = shape_map.basis, np.random.default_rng(3)
    places = np.vstack([source.vertices[::50], basis.centers[:5]])
    table = basis(places)
    for used in (4, 5, table.shape[1]):
        coefficients = rng.normal(size=(used, 3))
        expected = table[:, :used] @ coefficients
        assert basis.combined(places, coefficients) == pytest.approx(expected, rel=1e-9)


def test_the_displacement_solves_the_normal_equations_of_all_pairs():
    """Three equations for each pair, row by row, against sums of squares of blocks."""
    rng = np.random.default_rng(4)
    values, place = rng.normal(size=(30, 7)), rng.integers(0, 30, 50)
    goal, normals = rng.normal(size=(50, 3)), rng.normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    weights = rng.uniform(0.1, 1, 50)
    system, right = np.zeros((21, 21)), np.zeros(21)
    for k in range(50):
        row = np.kron(values[place[k]], np.eye(3))  # (3, 21), coordinates fastest
        across = np.outer(normals[k], normals[k])
        pull = weights[k] * ((1 - ALONG) * across + ALONG * np.eye(3))
        system += row.T @ pull @ row
        right += row.T @ pull @ goal[k]
    system[12:, 12:] += 0.5 * np.eye(9)
    strain = np.zeros((12, 12))
    strain[3:, 3:] = _strain_energy()
    system[:12, :12] += 0.5 * STRAIN * strain
    pulled, pull, goals = _pulls(place, goal, normals, weights)
    found = _solve(values[pulled], pull, goals, 0.5)
    assert found == pytest.approx(np.linalg.solve(system, right).reshape(7, 3), abs=1e-9)
