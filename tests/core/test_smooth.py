import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core.errors import Cancelled, MeshError
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.progress import ignore
from flyreg_core.smooth import SmoothParameters, averaging_matrix, smooth
from flyreg_core.topology import unique_edges
from tests.shapes import annulus, sphere, tetrahedron, torus

SEEDS = st.integers(0, 2**32 - 1)


def passes(shape, count):
    return smooth(*shape, SmoothParameters(count), ignore)


def test_with_three_neighbours_a_vertex_keeps_minus_an_eighth_of_itself():
    # beta = 5/4 - (3 - 1)^2 / 32 = 9/8, alpha = 3 (-1/8) / (9/8) = -1/3, alpha + 3 = 8/3
    row = averaging_matrix(tetrahedron()[1], 4).toarray()[0]
    assert row == pytest.approx([-1 / 8, 3 / 8, 3 / 8, 3 / 8])


def test_with_four_neighbours_a_vertex_keeps_a_thirty_second_of_itself():
    # beta = 5/4 - 3^2 / 32 = 31/32, alpha = 4 (1/32) / (31/32) = 4/31, alpha + 4 = 128/31
    octahedron = sphere(rounds=0)
    matrix = averaging_matrix(octahedron[1], 6).toarray()
    assert matrix.diagonal() == pytest.approx(1 / 32)
    assert passes(octahedron, 1) == pytest.approx(octahedron[0] / 32)  # neighbours cancel out


def test_with_six_neighbours_a_vertex_keeps_a_quarter_of_itself():
    # beta = 5/4 - (3 + 1)^2 / 32 = 3/4, alpha = 6 (1/4) / (3/4) = 2, alpha + 6 = 8
    _, faces = torus(around=8, across=6)
    matrix = averaging_matrix(faces, 48).toarray()
    edges, _ = unique_edges(faces)
    assert matrix.diagonal() == pytest.approx(1 / 4)
    assert matrix[edges[:, 0], edges[:, 1]] == pytest.approx(1 / 8)
    assert np.count_nonzero(matrix) == 48 + 2 * len(edges)


def test_a_tetrahedron_turns_inside_out_and_halves_with_each_pass():
    assert passes(tetrahedron(), 3) == pytest.approx(-tetrahedron()[0] / 8)


@pytest.mark.parametrize("shape", [tetrahedron(), sphere(), torus(), annulus()])
def test_the_rows_sum_to_one(shape):
    vertices, faces = shape
    assert averaging_matrix(faces, len(vertices)).sum(axis=1) == pytest.approx(1)


def test_a_vertex_without_neighbours_stays():
    vertices = np.vstack([sphere()[0], [[500.0, 600.0, 700.0]]])
    assert passes((vertices, sphere()[1]), 20)[-1].tolist() == [500, 600, 700]


def test_no_passes_change_nothing():
    vertices, faces = torus()
    assert np.array_equal(passes((vertices, faces), 0), vertices)


@given(first=st.integers(0, 60), second=st.integers(0, 60))
def test_passes_add_up(first, second):
    vertices, faces = torus(around=8, across=6)
    halfway = passes((vertices, faces), first)
    assert passes((halfway, faces), second) == pytest.approx(
        passes((vertices, faces), first + second), abs=1e-9
    )


@pytest.mark.parametrize("count", [1, 2, 3, 77, 500, 1001])
@pytest.mark.parametrize("shape", [tetrahedron(), sphere(), torus(), annulus()])
def test_it_is_what_the_passes_one_after_another_give(shape, count):
    vertices, faces = shape
    matrix, expected = averaging_matrix(faces, len(vertices)), np.array(vertices)
    for _ in range(count):
        expected = matrix @ expected
    size = np.abs(vertices).max()
    assert passes(shape, count) == pytest.approx(expected, rel=0, abs=1e-13 * size)


@given(seed=SEEDS)
def test_smoothing_follows_affine_maps(seed):
    rng = np.random.default_rng(seed)
    matrix, offset = rng.normal(size=(3, 3)), rng.normal(scale=100, size=3)
    vertices, faces = torus(around=8, across=6)
    mapped = passes((vertices @ matrix + offset, faces), 10)
    assert mapped == pytest.approx(passes((vertices, faces), 10) @ matrix + offset, abs=1e-9)


def test_a_sphere_shrinks_with_every_pass():
    vertices, faces = sphere()
    volumes = [SurfaceMesh(passes((vertices, faces), k), faces).volume for k in range(0, 100, 10)]
    assert all(less < more for more, less in itertools.pairwise(volumes))
    assert volumes[-1] > 0


@given(seed=SEEDS)
@settings(max_examples=20)
def test_noise_fades(seed):
    vertices, faces = sphere()
    noise = np.random.default_rng(seed).normal(size=(len(vertices), 1))
    rough = passes((vertices * (1 + 0.02 * noise), faces), 10)
    calm = passes((vertices, faces), 10)
    assert np.linalg.norm(rough - calm, axis=1).std() < 0.2 * (2 * noise).std()


def test_fewer_passes_than_none_are_refused():
    with pytest.raises(
        MeshError, match="the number of smoothing passes must be at least 0, not -1"
    ):
        passes(torus(), -1)


def test_the_vertices_that_were_given_are_not_changed():
    vertices, faces = torus()
    before = vertices.copy()
    passes((vertices, faces), 5)
    assert np.array_equal(vertices, before)


def test_smoothing_can_be_cancelled():
    told = []

    def report(fraction, text):
        told.append(fraction)
        if fraction >= 0.5:
            raise Cancelled

    with pytest.raises(Cancelled):
        smooth(*torus(), SmoothParameters(1000), report)
    assert told[-1] < 0.6
