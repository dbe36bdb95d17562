import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flyreg_core.chordal_deviation import ALONG, Ground, chordal_deviations
from flyreg_core.cut import PIECES
from flyreg_core.landmarks import HALVES
from flyreg_core.locate import build_grid, strip_grid
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.refine import CLOSEST_TO_END

SIZE_UM, RIDGE = 100.0, 0.4
ROOF = np.array([[0, 0], [RIDGE, 0], [1, 0], [0, 1], [RIDGE, 1], [1, 1]])
ROOF_FACES = np.array([[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4]])
PLACES = st.tuples(st.floats(0.01, 0.99), st.floats(0.01, 0.99))


def ground_of(heights: np.ndarray) -> Ground:
    """A square of four faces, two on either side of a line, at heights above its corners."""
    surface = SurfaceMesh(SIZE_UM * np.column_stack([ROOF, heights]), ROOF_FACES)
    normals = surface.face_normals
    return Ground(
        build_grid(ROOF[ROOF_FACES], np.arange(4), ROOF_FACES),
        False,
        surface.vertices[ROOF_FACES],
        normals / np.linalg.norm(normals, axis=1, keepdims=True),
    )


def deviation(ground: Ground, start, end):
    starts, ends = np.array([start]), np.array([end])
    lifted = np.stack([ground.lift(starts), ground.lift(ends)], axis=1)
    return chordal_deviations(ground, starts, ends - starts, lifted), lifted[0]


@given(start=PLACES, end=PLACES, slope=st.tuples(*[st.floats(-2, 2)] * 2))
def test_no_edge_leaves_a_plane(start, end, slope):
    found, _ = deviation(ground_of(ROOF @ np.array(slope)), start, end)
    assert found.area[0] == pytest.approx(0, abs=1e-9)
    assert found.most[0] == pytest.approx(0, abs=1e-9)


@given(start=PLACES, end=PLACES, slope=st.floats(0.1, 2))
def test_an_edge_over_a_ridge_leaves_it_most_there_and_by_what_geometry_says(start, end, slope):
    """Over a roof the chord is straight and the surface bent once: a triangle is between them."""
    ground = ground_of(-slope * np.abs(ROOF[:, 0] - RIDGE))
    found, lifted = deviation(ground, start, end)
    step = end[0] - start[0]
    crosses = (start[0] - RIDGE) * (end[0] - RIDGE) < 0
    share = (RIDGE - start[0]) / step if crosses else 0.5
    chord = lifted[0] + share * (lifted[1] - lifted[0])
    below = abs(chord[2]) if crosses else 0.0
    turn = np.hypot(1, slope)  # of a unit upwards 1 / turn is across the roof
    off = below * (1 + ALONG * slope) / turn
    length = np.linalg.norm(lifted[1] - lifted[0])
    assert found.area[0] == pytest.approx(off * length / 2, rel=1e-6, abs=1e-6)
    if crosses and CLOSEST_TO_END < share < 1 - CLOSEST_TO_END and off > 1e-6:
        assert found.most[0] == pytest.approx(off)
        assert found.share[0] == pytest.approx(share)
        height = start[1] + share * (end[1] - start[1])
        assert found.points[0] == pytest.approx([SIZE_UM * RIDGE, SIZE_UM * height, 0], abs=1e-6)


@pytest.fixture(scope="module", params=HALVES)
def over_a_brain(request, demo_source, demo_target):
    """The target's half, and edges of the source's laid flat on it, with their ends lifted."""
    half = request.param
    brain = demo_target.flat
    faces = np.flatnonzero(brain.dissection.piece_of_face == PIECES.index(half))
    normals = demo_target.surface.face_normals[faces]
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    corners = demo_target.surface.vertices[demo_target.surface.faces[faces]]
    ground = Ground(strip_grid(brain.halves[half].flat), True, corners, normals)
    own = demo_source.flat.halves[half]
    some = np.random.default_rng(5).choice(len(own.springs.edges), 2000, replace=False)
    first, second = own.flat.uv[own.springs.edges[some].T]
    steps = second - first
    steps[:, 0] += own.springs.jumps[some]
    return ground, first, steps, np.stack([ground.lift(first), ground.lift(second)], axis=1)


def off_at(ground: Ground, first, steps, lifted, share: float) -> np.ndarray:
    """How far a surface is off the chords at a share of each, looked up there."""
    face, barycentric = ground.find(first + share * steps)
    points = np.einsum("ij,ijk->ik", barycentric, ground.corners[face])
    away = points - (1 - share) * lifted[:, 0] - share * lifted[:, 1]
    across = np.abs(np.einsum("ij,ij->i", away, ground.normals[face]))
    return across + ALONG * np.sqrt(np.maximum((away**2).sum(axis=1) - across**2, 0))


def test_a_walk_from_crossing_to_crossing_adds_up_to_what_many_places_on_the_way_do(over_a_brain):
    _, _, _, lifted = over_a_brain
    walked = chordal_deviations(*over_a_brain)
    off = np.array([off_at(*over_a_brain, share) for share in (np.arange(200) + 0.5) / 200])
    sampled = off.mean(axis=0) * np.linalg.norm(lifted[:, 1] - lifted[:, 0], axis=1)
    assert walked.area.sum() == pytest.approx(sampled.sum(), rel=0.03)
    assert np.median(np.abs(walked.area - sampled)) < 0.03 * np.median(sampled)
    assert (walked.most <= off.max(axis=0) * 1.1 + 0.3).mean() > 0.99


def test_the_place_where_an_edge_is_farthest_off_is_on_the_surface_below_it(over_a_brain):
    ground, first, steps, _ = over_a_brain
    walked = chordal_deviations(*over_a_brain)
    there = walked.most > 0
    assert there.mean() > 0.5
    below = ground.lift((first + walked.share[:, np.newaxis] * steps)[there])
    assert np.percentile(np.linalg.norm(below - walked.points[there], axis=1), 99) < 1e-6


def test_a_strip_is_the_same_after_whole_turns(over_a_brain):
    ground, first, steps, lifted = over_a_brain
    turned = chordal_deviations(ground, first + np.array([3, 0]), steps, lifted)
    assert turned.area == pytest.approx(chordal_deviations(*over_a_brain).area, abs=1e-6)
