import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flyreg_core.frame import ANTERO_POSTERIOR, DORSO_VENTRAL, LEFT_RIGHT, BrainFrame
from flyreg_core.mesh import SurfaceMesh
from tests.frames import FAR, UPRIGHT, laid, random_frame
from tests.shapes import box

SEEDS = st.integers(0, 2**32 - 1)
EITHER = st.booleans()


def random_points(seed, shape=(20, 3)):
    return np.random.default_rng(seed).uniform(-FAR, FAR, shape)


@given(seed=SEEDS, is_mirrored=EITHER)
def test_coordinates_and_points_undo_one_another(seed, is_mirrored):
    frame, points = random_frame(seed, is_mirrored), random_points(seed)
    assert frame.points(frame.coordinates(points)) == pytest.approx(points, abs=1e-9 * FAR)
    assert frame.coordinates(frame.points(points)) == pytest.approx(points, abs=1e-9 * FAR)


@given(seed=SEEDS, is_mirrored=EITHER)
def test_a_frame_keeps_all_distances(seed, is_mirrored):
    frame, points = random_frame(seed, is_mirrored), random_points(seed)
    away = np.linalg.norm(points[:, None] - points, axis=2)
    coordinates = frame.coordinates(points)
    found = np.linalg.norm(coordinates[:, None] - coordinates, axis=2)
    assert found == pytest.approx(away, abs=1e-9 * FAR)


@given(seed=SEEDS, is_mirrored=EITHER)
def test_the_origin_has_coordinates_0_and_each_step_along_an_axis_counts_on_that_axis(
    seed, is_mirrored
):
    frame = random_frame(seed, is_mirrored)
    assert frame.coordinates(frame.origin).tolist() == [0, 0, 0]
    for axis in (LEFT_RIGHT, DORSO_VENTRAL, ANTERO_POSTERIOR):
        stepped = frame.coordinates(frame.origin + 7 * frame.axes[axis])
        assert stepped == pytest.approx(7 * np.eye(3)[axis], abs=1e-9 * FAR)


@given(seed=SEEDS, is_mirrored=EITHER)
def test_a_step_to_the_front_or_the_top_lowers_its_coordinate_alone(seed, is_mirrored):
    frame = random_frame(seed, is_mirrored)
    to_front, to_top = (
        frame.coordinates(frame.origin + way) for way in (frame.anterior, frame.dorsal)
    )
    assert to_front == pytest.approx(np.array([0, 0, -1]), abs=1e-9 * FAR)
    assert to_top == pytest.approx(np.array([0, -1, 0]), abs=1e-9 * FAR)


@given(seed=SEEDS, is_mirrored=EITHER)
def test_a_frame_is_mirrored_where_it_shows_a_box_inside_out(seed, is_mirrored):
    frame, brain = random_frame(seed, is_mirrored), SurfaceMesh(*box())
    assert frame.is_mirrored == is_mirrored
    seen = SurfaceMesh(frame.coordinates(brain.vertices), brain.faces)
    assert seen.volume == pytest.approx(-brain.volume if is_mirrored else brain.volume)


@given(seed=SEEDS)
def test_turning_one_axis_round_mirrors_a_frame_and_turning_two_does_not(seed):
    frame = random_frame(seed)
    for axis in range(3):
        one = frame.axes.copy()
        one[axis] *= -1
        assert BrainFrame(frame.origin, one).is_mirrored
        assert not BrainFrame(frame.origin, -one).is_mirrored


def test_the_axes_of_the_file_change_nothing():
    points = random_points(1)
    assert np.array_equal(UPRIGHT.coordinates(points), points)
    assert UPRIGHT.anterior.tolist() == [0, 0, -1]
    assert UPRIGHT.dorsal.tolist() == [0, -1, 0]


@pytest.mark.parametrize("shape", [(3,), (0, 3), (4, 3), (2, 4, 3)])
def test_points_may_come_in_any_array(shape):
    frame, points = random_frame(2), random_points(3, shape)
    one_by_one = [frame.coordinates(point) for point in points.reshape(-1, 3)]
    assert frame.coordinates(points).shape == frame.points(points).shape == shape
    expected = np.array(one_by_one).reshape(shape)
    assert frame.coordinates(points) == pytest.approx(expected, abs=1e-9 * FAR)


@pytest.mark.parametrize("is_mirrored", [False, True])
def test_a_brain_laid_in_a_file_is_seen_from_outside_there(is_mirrored):
    frame, brain = random_frame(4, is_mirrored), SurfaceMesh(*box())
    there = laid(brain, frame)
    assert there.volume == pytest.approx(brain.volume)
    assert frame.coordinates(there.vertices) == pytest.approx(brain.vertices, abs=1e-9 * FAR)
