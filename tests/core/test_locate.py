import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from flyreg_core.flatten import FlattenParameters, flatten
from flyreg_core.locate import build_grid, find_triangles, strip_grid
from flyreg_core.mesh import FlatMesh
from flyreg_core.progress import ignore
from flyreg_core.rectangle import wrapped
from tests.core.test_flatten import random_ring

SEEDS = st.integers(0, 2**32 - 1)


def random_strip(seed):
    ring, surface = random_ring(seed)
    return flatten(ring, surface.face_areas, FlattenParameters(rounds=1), ignore)[0]


def random_points(seed, count=100):
    return np.random.default_rng(seed).uniform(size=(count, 2))


def weights_in(corners, point):
    """The barycentric coordinates of a point in each of (m, 3, 2) triangles, by Cramer's rule."""
    a, b, c = (corners[:, k] - point for k in range(3))
    twice = np.stack(
        [p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] for p, q in ((b, c), (c, a), (a, b))], 1
    )
    return twice / twice.sum(axis=1, keepdims=True)


def faces_around(flat, point):
    """All faces that a point of the strip lies in, by trying each face and each turn."""
    return {
        int(face)
        for turn in range(-5, 6)
        for face in np.flatnonzero(
            weights_in(flat.corners, np.add(point, [turn, 0])).min(axis=1) > -1e-12
        )
    }


def places(flat, faces, barycentric):
    return np.einsum("ij,ijk->ik", barycentric, flat.corners[faces])


@given(seed=SEEDS)
@settings(max_examples=25)
def test_every_point_of_the_strip_is_found_in_a_face_it_lies_in(seed):
    flat, points = random_strip(seed), random_points(seed)
    faces, _ = find_triangles(strip_grid(flat), points)
    for face, point in zip(faces, points, strict=True):
        assert int(face) in faces_around(flat, point)


@given(seed=SEEDS)
def test_the_coordinates_in_a_face_lead_back_to_the_point(seed):
    flat, points = random_strip(seed), random_points(seed)
    faces, barycentric = find_triangles(strip_grid(flat), points)
    away = places(flat, faces, barycentric) - points
    assert wrapped(away[:, 0]) == pytest.approx(0, abs=1e-9)
    assert away[:, 1] == pytest.approx(0, abs=1e-9)
    assert barycentric.min() >= 0
    assert barycentric.sum(axis=1) == pytest.approx(1)


@given(seed=SEEDS)
def test_every_vertex_is_found_where_it_is(seed):
    flat = random_strip(seed)
    points = np.stack([np.mod(flat.uv[:, 0], 1), flat.uv[:, 1]], axis=1)
    faces, barycentric = find_triangles(strip_grid(flat), points)
    corner = barycentric.argmax(axis=1)
    assert np.array_equal(flat.faces[faces, corner], np.arange(len(points)))
    assert barycentric.max(axis=1) == pytest.approx(1, abs=1e-9)


@given(seed=SEEDS)
@settings(max_examples=25)
def test_a_walk_from_any_face_ends_where_the_grid_would_find_the_point(seed):
    flat, points = random_strip(seed), random_points(seed)
    grid = strip_grid(flat)
    near = np.random.default_rng(seed).integers(len(flat.faces), size=len(points))
    faces, barycentric = find_triangles(grid, points, near)
    expected = places(flat, *find_triangles(grid, points))
    away = places(flat, faces, barycentric) - expected
    away[:, 0] = wrapped(away[:, 0])
    assert np.abs(away).max() < 1e-9
    assert barycentric.min() >= 0


@given(seed=SEEDS)
def test_on_a_plain_triangulation_the_answer_is_that_of_another_library(seed):
    rng = np.random.default_rng(seed)
    other = Delaunay(np.vstack([rng.uniform(size=(60, 2)), [[0, 0], [0, 1], [1, 0], [1, 1]]]))
    simplices = other.simplices.astype(np.int64)
    corners = other.points[simplices]
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    turned = ab[:, 0] * ac[:, 1] < ab[:, 1] * ac[:, 0]
    corners[turned], simplices[turned] = corners[turned][:, ::-1], simplices[turned][:, ::-1]
    points = rng.uniform(size=(200, 2))
    grid = build_grid(corners, np.arange(len(corners)), simplices)
    faces, _ = find_triangles(grid, points)
    assert np.array_equal(faces, other.find_simplex(points))


@given(seed=SEEDS)
def test_points_outside_the_strip_are_moved_into_a_face_of_their_cell(seed):
    flat = random_strip(seed)
    points = random_points(seed)
    points[:50, 1] += 1
    points[50:, 1] -= 1
    faces, barycentric = find_triangles(strip_grid(flat), points)
    found = faces >= 0
    assert barycentric[found].min() >= 0
    assert barycentric[found].sum(axis=1) == pytest.approx(1)
    assert (barycentric[~found] == 0).all()


def test_a_point_just_outside_comes_to_the_nearest_edge():
    corners = np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]])
    faces, barycentric = find_triangles(
        build_grid(corners, np.arange(2), np.array([[0, 1, 3], [1, 2, 3]])),
        np.array([[0.25, -1e-9]]),
    )
    assert faces.tolist() == [0]
    assert barycentric[0] == pytest.approx([0.75, 0.25, 0.0])


def test_a_point_whose_cell_is_empty_is_told():
    triangles = np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]] * 32) * 0.1
    triangles[16:] += 0.9
    faces, barycentric = find_triangles(
        build_grid(triangles, np.arange(32), np.arange(96).reshape(32, 3)), np.array([[0.95, 0.05]])
    )
    assert faces.tolist() == [-1]
    assert barycentric.tolist() == [[0, 0, 0]]


def test_faces_that_reach_beyond_the_end_of_the_strip_are_found_on_both_sides():
    uv = np.array([[0.9, 0.0], [0.1, 0.0], [0.0, 1.0]])
    flat = FlatMesh(uv, np.array([[0, 1, 2]]), np.array([[0, 1, 1]]))
    faces, barycentric = find_triangles(strip_grid(flat), np.array([[0.95, 0.1], [0.05, 0.1]]))
    assert faces.tolist() == [0, 0]
    assert barycentric[0] == pytest.approx([0.7, 0.2, 0.1])
    assert barycentric[1] == pytest.approx([0.2, 0.7, 0.1])


@pytest.mark.parametrize("turns", [-3, 0, 2])
def test_whole_turns_of_the_strip_change_nothing(turns):
    flat, points = random_strip(4), random_points(4)
    turned = FlatMesh(np.add(flat.uv, [turns, 0]), flat.faces, flat.corner_shifts)
    faces, _ = find_triangles(strip_grid(turned), points)
    assert np.array_equal(faces, find_triangles(strip_grid(flat), points)[0])


@given(seed=SEEDS)
@settings(max_examples=20)
def test_points_on_edges_and_borders_are_found_too(seed):
    flat = random_strip(seed)
    edge_middles = (flat.corners + np.roll(flat.corners, 1, axis=1)).reshape(-1, 2) / 2
    points = np.stack([np.mod(edge_middles[:, 0], 1.0), edge_middles[:, 1]], axis=1)
    faces, barycentric = find_triangles(strip_grid(flat), points)
    away = places(flat, faces, barycentric) - points
    assert wrapped(away[:, 0]) == pytest.approx(0, abs=1e-9)
    assert away[:, 1] == pytest.approx(0, abs=1e-9)
