from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flyreg_core.orientation import orientations, signed_areas

TRIANGLE = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]])
SEEDS = st.integers(0, 2**32 - 1)
COORDINATES = st.floats(-1e100, 1e100) | st.integers(-9, 9).map(float) | st.floats(-1e-160, 1e-160)
TRIANGLES = st.lists(COORDINATES, min_size=6, max_size=6).map(lambda x: np.reshape(x, (3, 2)))


def sign_by_fractions(triangle):
    (a, b), (c, d), (e, f) = [[Fraction(x) for x in corner] for corner in triangle.tolist()]
    twice = a * d - b * c + c * f - d * e + e * b - f * a  # the shoelace formula
    return (twice > 0) - (twice < 0)


def nearly_flat(seed):
    """Three points that would lie on one line were they not moved by a few units of rounding."""
    rng = np.random.default_rng(seed)
    start, end = rng.uniform(-10, 10, (2, 2))
    points = start + (end - start) * rng.uniform(-2, 2, (3, 1))
    return points * (1 + rng.integers(-2, 3, (3, 2)) * 2.0**-52)


def test_the_area_is_that_of_the_triangle_and_negative_where_it_turns_clockwise():
    assert signed_areas(np.array([TRIANGLE, TRIANGLE[::-1]])).tolist() == [6.0, -6.0]


def test_a_triangle_turns_counter_clockwise_clockwise_or_not_at_all():
    flat = TRIANGLE * [1.0, 0.0]
    assert orientations(np.array([TRIANGLE, TRIANGLE[::-1], flat])).tolist() == [1, -1, 0]


@given(triangle=TRIANGLES)
def test_the_sign_is_that_of_exact_arithmetic(triangle):
    assert orientations(triangle[None])[0] == sign_by_fractions(triangle)


@given(seed=SEEDS)
def test_the_sign_is_exact_for_triangles_that_are_nearly_flat(seed):
    triangles = np.array([nearly_flat((seed, k)) for k in range(20)])
    assert orientations(triangles).tolist() == [sign_by_fractions(t) for t in triangles]


def test_rounding_alone_would_be_wrong():
    triangles = np.array([nearly_flat(seed) for seed in range(300)])
    assert (np.sign(signed_areas(triangles)) != orientations(triangles)).any()


@given(triangle=TRIANGLES)
def test_exchanging_two_corners_changes_the_sign_and_turning_does_not(triangle):
    turned = np.array([triangle, np.roll(triangle, 1, axis=0), triangle[[1, 0, 2]]])
    sign, same, opposite = orientations(turned)
    assert sign == same == -opposite


@pytest.mark.parametrize("count", [0, 1, 5])
def test_there_is_one_sign_for_each_triangle(count):
    assert orientations(np.broadcast_to(TRIANGLE, (count, 3, 2))).tolist() == [1] * count
