import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from flyreg_core.rectangle import from_plane, to_plane, wrapped
from flyreg_core.strip_warp import draw_along, find_fading, to_strip

SEEDS = st.integers(0, 2**32 - 1)


@given(seed=SEEDS, outer=st.integers(1, 9), hole=st.integers(1, 9))
def test_boundaries_draw_vertices_along_as_periodic_interpolation_would(seed, outer, hole):
    rng = np.random.default_rng(seed)
    count = 40
    u, beta, shift = rng.uniform(-2, 2, count), rng.uniform(size=count), rng.normal(size=count)
    order = rng.permutation(count)
    loops = order[:outer], order[outer : outer + hole]
    misses = rng.normal(size=(outer, 2)), rng.normal(size=(hole, 2))
    fadings = find_fading(u, loops[0], beta), find_fading(u, loops[1], 1 - beta)
    moved = draw_along(u, shift, beta, fadings, misses)
    expected = np.stack([u + shift, beta], axis=1)
    for loop, miss, part in zip(loops, misses, (beta, 1 - beta), strict=True):
        for axis in (0, 1):
            known = np.interp(np.mod(u, 1), np.mod(u[loop], 1), miss[:, axis], period=1.0)
            expected[:, axis] += part * known
    assert np.abs(moved - expected).max() < 1e-12


@given(seed=SEEDS)
def test_places_of_the_rectangle_are_reached_the_short_way_around(seed):
    rng = np.random.default_rng(seed)
    places, u = rng.uniform(-2, 2, (30, 2)), rng.uniform(-3, 3, 30)
    shift, beta = to_strip(places, u)
    assert np.abs(shift).max() <= 0.5
    there, expected = from_plane(places)
    assert np.array_equal(beta, expected)
    assert np.abs(wrapped(u + shift - there)).max() < 1e-12


@given(seed=SEEDS)
def test_a_place_that_does_not_move_has_no_shift(seed):
    rng = np.random.default_rng(seed)
    u, beta = rng.uniform(-3, 3, 30), rng.uniform(size=30)
    shift, again = to_strip(to_plane(u, beta), u)
    assert np.abs(shift).max() < 1e-12
    assert np.abs(again - beta).max() < 1e-12
