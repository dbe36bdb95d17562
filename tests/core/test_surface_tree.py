import igl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core.mesh import SurfaceMesh
from tests.shapes import sphere, torus

SEEDS = st.integers(0, 2**32 - 1)


def rough_torus(seed, around=31, across=17):
    vertices, faces = torus(around=around, across=across)
    rng = np.random.default_rng(seed)
    return SurfaceMesh(vertices + rng.normal(scale=20, size=vertices.shape), faces)


def places(surface, face, barycentric):
    return np.einsum("ij,ijk->ik", barycentric, surface.vertices[surface.faces[face]])


def nearest_of_all_faces(points, surface):
    """By the slow way: each point against each face, one at a time."""
    single = [SurfaceMesh(surface.vertices, face[None]).tree for face in surface.faces]
    squared = np.array([tree.nearest(points)[0] for tree in single])
    return squared.min(axis=0), squared.argmin(axis=0)


@given(seed=SEEDS)
@settings(max_examples=10)
def test_the_places_are_those_that_another_library_finds(seed):
    surface = rough_torus(seed)
    points = np.random.default_rng(seed).normal(scale=200, size=(500, 3))
    squared, face, barycentric = surface.tree.nearest(points)
    expected, _, there = igl.point_mesh_squared_distance(points, surface.vertices, surface.faces)
    assert squared == pytest.approx(expected, rel=1e-9)
    assert places(surface, face, barycentric) == pytest.approx(there, abs=1e-9)


@given(seed=SEEDS)
@settings(max_examples=10)
def test_coordinates_are_within_the_faces(seed):
    surface = rough_torus(seed)
    points = np.random.default_rng(seed).normal(scale=200, size=(500, 3))
    barycentric = surface.tree.nearest(points)[2]
    assert barycentric.min() >= 0
    assert barycentric.sum(axis=1) == pytest.approx(1)


def test_the_order_of_the_points_does_not_matter():
    surface = SurfaceMesh(*sphere())
    points = np.vstack([surface.vertices, 2 * surface.vertices, surface.vertices / 2])
    order = np.random.default_rng(1).permutation(len(points))
    there, shuffled = (surface.tree.nearest(part) for part in (points, points[order]))
    for values, other in zip(there, shuffled, strict=True):
        assert np.array_equal(values[order], other)


@pytest.mark.parametrize("count", [1, 2, 3, 5, 9])
def test_a_surface_may_have_few_faces(count):
    vertices, faces = sphere()
    surface = SurfaceMesh(vertices, faces[:count])
    points = np.random.default_rng(2).normal(scale=200, size=(100, 3))
    squared, face, _ = surface.tree.nearest(points)
    expected, first = nearest_of_all_faces(points, surface)
    assert np.array_equal(squared, expected)
    assert np.array_equal(face, first)


@pytest.mark.parametrize(
    ("corners", "expected"),
    [
        ([[0, 0, 0], [10, 0, 0], [4, 0, 0]], [3, 0, 0]),
        ([[4, 0, 0], [0, 0, 0], [10, 0, 0]], [3, 0, 0]),
        ([[0, 0, 0], [0, 0, 0], [10, 0, 0]], [3, 0, 0]),
        ([[10, 0, 0], [0, 0, 0], [0, 0, 0]], [3, 0, 0]),
        ([[5, 1, 0], [5, 1, 0], [5, 1, 0]], [5, 1, 0]),
        ([[0, 0, 0], [10, 0, 0], [4, 1e-14, 0]], [3, 0, 0]),
    ],
)
def test_a_face_without_area_is_a_line_or_a_point(corners, expected):
    surface = SurfaceMesh(np.array(corners, dtype=float), np.array([[0, 1, 2]]))
    _, face, barycentric = surface.tree.nearest(np.array([[3.0, -4.0, 0.0]]))
    assert places(surface, face, barycentric)[0] == pytest.approx(expected, abs=1e-9)


def test_the_tree_of_a_surface_is_built_once():
    surface = SurfaceMesh(*sphere())
    assert surface.tree is surface.tree
    assert surface.tree is not SurfaceMesh(*sphere()).tree


def test_no_points_have_no_places():
    squared, face, barycentric = SurfaceMesh(*sphere()).tree.nearest(np.zeros((0, 3)))
    assert (squared.shape, face.shape, barycentric.shape) == ((0,), (0,), (0, 3))
