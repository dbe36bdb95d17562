import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flyreg_core.landmarks import HALVES
from flyreg_core.rectangle import (
    HEIGHT,
    HOLE,
    PERIMETER,
    WIDTH,
    RadialLaw,
    from_plane,
    perimeter_of_u,
    perimeter_share,
    radial_law,
    to_plane,
    u_of_perimeter,
    wrapped,
)

SEEDS = st.integers(0, 2**32 - 1)
SHARES = st.lists(st.floats(0, 1), min_size=1, max_size=20).map(np.array)
RATES = st.floats(-30, 30) | st.just(0.0) | st.floats(-1e-8, 1e-8)
X, Y = WIDTH / 2, HEIGHT / 2


def place(curve, share, half="anterior"):
    """Where a share of a curve is shown, as seen from outside the brain."""
    u = u_of_perimeter(half, perimeter_share(curve, np.array([share])))
    return to_plane(u, np.array([0.0 if curve == "hole" else 1.0]))[0]


@given(seed=SEEDS)
def test_every_place_but_the_middle_is_shown_where_it_came_from(seed):
    points = np.random.default_rng(seed).uniform(-3, 3, (50, 2))
    points = points[np.abs(points).max(axis=1) > 1e-3]
    assert to_plane(*from_plane(points)) == pytest.approx(points, abs=1e-12)


@given(u=SHARES, beta=st.floats(-0.3, 3))
def test_every_point_of_the_strip_is_found_again(u, beta):
    back_u, back_beta = from_plane(to_plane(u, np.full(len(u), beta)))
    assert wrapped(back_u - u) == pytest.approx(0, abs=1e-12)
    assert back_beta == pytest.approx(beta, abs=1e-12)
    assert ((back_u >= 0) & (back_u < 1)).all()


def test_the_corners_of_the_rectangle_are_where_the_sides_meet():
    assert place("upper", 0) == pytest.approx([-X, Y])
    assert place("upper", 1) == pytest.approx([X, Y])
    assert place("left", 0) == pytest.approx([X, Y])
    assert place("left", 1) == pytest.approx([X, -Y])
    assert place("lower", 0) == pytest.approx([-X, -Y])
    assert place("lower", 1) == pytest.approx([X, -Y])
    assert place("right", 0) == pytest.approx([-X, Y])
    assert place("right", 1) == pytest.approx([-X, -Y])


@pytest.mark.parametrize("curve", ["upper", "lower", "left", "right"])
@given(share=st.floats(0, 1))
def test_a_share_of_a_side_is_that_share_of_the_way_between_its_corners(curve, share):
    start, end = place(curve, 0.0), place(curve, 1.0)
    assert place(curve, share) == pytest.approx((1 - share) * start + share * end)


def test_the_hole_starts_at_its_top_and_turns_to_the_left_of_the_animal():
    assert place("hole", 0) == pytest.approx([0, HOLE * Y])
    assert place("hole", 0.25)[0] == pytest.approx(HOLE * X)
    assert place("hole", 0.5) == pytest.approx([0, -HOLE * Y])
    assert place("hole", 0.75)[0] == pytest.approx(-HOLE * X)


@given(beta=st.floats(0, 1), u=SHARES)
def test_points_of_equal_beta_lie_on_a_smaller_rectangle(beta, u):
    points = to_plane(u, np.full(len(u), beta))
    size = np.abs(points / [X, Y]).max(axis=1)
    assert size == pytest.approx(HOLE + (1 - HOLE) * beta)


@given(u=st.floats(0, 1), beta=st.floats(0, 1))
def test_points_of_equal_u_lie_on_a_ray_from_the_centre(u, beta):
    inner, outer = to_plane(np.full(2, u), np.array([beta, 1.0]))
    assert inner[0] * outer[1] == pytest.approx(inner[1] * outer[0], abs=1e-12)
    assert inner @ outer > 0


@pytest.mark.parametrize("curve", ["upper", "lower", "left", "right", "hole"])
@given(share=st.floats(0, 1))
def test_the_posterior_half_is_the_mirror_image_of_the_anterior_one(curve, share):
    assert place(curve, share, "posterior") == pytest.approx(place(curve, share) * [-1, 1])


@pytest.mark.parametrize("half", HALVES)
@given(u=SHARES)
def test_perimeter_and_u_are_inverse(half, u):
    assert perimeter_of_u(half, u_of_perimeter(half, u)) == pytest.approx(u)


def test_u_runs_around_in_shares_of_the_perimeter():
    u = np.linspace(0, 1, 4001)
    points = to_plane(u, np.ones(4001))
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert steps.sum() == pytest.approx(PERIMETER)
    assert steps == pytest.approx(PERIMETER / 4000)


@given(difference=st.floats(-1e6, 1e6))
def test_wrapped_differences_are_the_least_of_those_that_differ_by_whole_turns(difference):
    result = float(wrapped(np.array(difference)))
    assert abs(result) <= 0.5
    assert difference - result == pytest.approx(round(difference - result), abs=1e-9)


@given(rate=RATES, v=SHARES)
def test_v_and_beta_are_inverse(rate, v):
    law = RadialLaw(rate)
    assert law.v(law.beta(v)) == pytest.approx(v, abs=1e-9 + 1e-15 * np.exp(abs(rate)))


@given(rate=RATES)
def test_beta_grows_from_0_on_the_hole_to_1_outside(rate):
    beta = RadialLaw(rate).beta(np.linspace(0, 1, 101))
    assert beta[0] == 0
    assert beta[-1] == pytest.approx(1)
    assert (np.diff(beta) > 0).all()


@given(seed=SEEDS, power=st.floats(-3, 3))
def test_half_of_the_area_has_half_of_the_room(seed, power):
    rng = np.random.default_rng(seed)
    v, area = rng.uniform(size=4000) ** np.exp(power / 2), rng.uniform(size=4000)
    size = HOLE + (1 - HOLE) * radial_law(v, area).beta(v)
    inner = size**2 - HOLE**2 < (1 - HOLE**2) / 2  # shares of the room around the hole
    assert area[inner].sum() / area.sum() == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("v", [0.0, 1e-9, 0.5, 1 - 1e-9, 1.0])
def test_there_is_a_law_wherever_the_area_lies(v):
    law = radial_law(np.array([v, v]), np.array([1.0, 2.0]))
    assert np.isfinite(law.rate)
    assert (np.diff(law.beta(np.linspace(0, 1, 11))) >= 0).all()
