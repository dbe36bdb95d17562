import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core.boundary import curve_key
from flyreg_core.boundary_map import map_boundaries, seam_gaps
from flyreg_core.correspondence import FlatBrain
from flyreg_core.landmarks import CURVES, HALVES
from flyreg_core.rectangle import HEIGHT, PERIMETER, WIDTH

SEEDS = st.integers(0, 2**32 - 1)
SIZES = st.sampled_from([0.0, 1e-3, 0.03, 0.2, 0.5])
OUTER = [("upper", None), ("lower", None), *((s, h) for s in ("left", "right") for h in HALVES)]


@pytest.fixture(scope="module")
def source(demo_source) -> FlatBrain:
    return demo_source.flat


@pytest.fixture(scope="module")
def target(demo_target) -> FlatBrain:
    return demo_target.flat


def shifts(brain, seed=0, size=0.0, constant=(0.0, 0.0)):
    """Random shifts of u, rough at every vertex, and a constant one for each half."""
    rng = np.random.default_rng(seed)
    return {
        half: shift + rng.normal(scale=size, size=len(brain.halves[half].vertex_of))
        for half, shift in zip(HALVES, constant, strict=True)
    }


def points_at(brain, mapped):
    """Where shares of a brain's curves lie."""
    return {key: brain.curves[key].at(shares) for key, shares in mapped.items()}


@given(seed=SEEDS, size=SIZES)
def test_shares_grow_along_every_curve_whatever_the_shifts(source, seed, size):
    for shares in map_boundaries(source, shifts(source, seed, size)).values():
        assert (np.diff(shares) > 0).all()


@given(seed=SEEDS, size=SIZES)
def test_corners_go_to_corners(source, seed, size):
    mapped = map_boundaries(source, shifts(source, seed, size))
    for key in OUTER:
        assert mapped[key][0] == 0
        assert mapped[key][-1] == pytest.approx(1, abs=1e-12)


@given(seed=SEEDS, size=SIZES)
def test_the_hole_goes_once_around_the_hole(source, seed, size):
    shares = map_boundaries(source, shifts(source, seed, size))["hole", None]
    assert shares[-1] - shares[0] == pytest.approx(1)


def test_every_curve_has_a_share_for_each_of_its_vertices(source):
    mapped = map_boundaries(source, shifts(source))
    assert set(mapped) == set(source.curves)
    for key, shares in mapped.items():
        assert len(shares) == len(source.curves[key].vertices)


def test_without_a_shift_every_vertex_keeps_its_share(source):
    for key, shares in map_boundaries(source, shifts(source)).items():
        assert shares == pytest.approx(source.curves[key].share, abs=1e-12)


@given(turn=st.floats(-0.5, 0.5))
@settings(max_examples=20)
def test_a_turn_of_both_halves_turns_the_hole_by_as_much(source, turn):
    # the posterior half is seen from behind, so the same turn has the other sign there
    mapped = map_boundaries(source, shifts(source, constant=(turn, -turn)))
    moved = mapped["hole", None] - source.curves["hole", None].share
    assert moved == pytest.approx(turn, abs=1e-9)


@given(turn=st.floats(-0.5, 0.5))
@settings(max_examples=20)
def test_each_half_counts_for_half_on_a_curve_that_both_share(source, turn):
    for constant in ((turn, 0.0), (0.0, -turn)):
        mapped = map_boundaries(source, shifts(source, constant=constant))
        moved = mapped["hole", None] - source.curves["hole", None].share
        assert moved == pytest.approx(turn / 2, abs=1e-9)


@pytest.mark.parametrize("half", HALVES)
def test_a_side_of_one_half_follows_that_half_alone(source, half):
    other = HALVES[1 - HALVES.index(half)]
    still = map_boundaries(source, shifts(source))
    moved = map_boundaries(source, {**shifts(source), other: shifts(source, 1, 0.05)[other]})
    for side in ("left", "right"):
        assert np.array_equal(moved[side, half], still[side, half])
        assert not np.array_equal(moved[side, other], still[side, other])


@pytest.mark.parametrize("half", HALVES)
@pytest.mark.parametrize("name", ["upper", "lower", "left", "right"])
def test_a_gentle_shift_along_a_side_moves_its_vertices_by_as_much(source, half, name):
    curve = source.curves[curve_key(name, half)]
    length = WIDTH if name in ("upper", "lower") else HEIGHT
    bend = 0.05 * np.sin(np.pi * curve.share)  # no shift at the corners
    shift = shifts(source)
    for one in HALVES if curve_key(name, half)[1] is None else (half,):
        own = np.searchsorted(source.halves[one].vertex_of, curve.vertices)
        forwards = name in ("upper", "left")  # u runs clockwise, as the front is seen
        sign = (1 if forwards else -1) * (1 if one == "anterior" else -1)
        shift[one][own] = sign * bend * length / PERIMETER
    moved = map_boundaries(source, shift)[curve_key(name, half)] - curve.share
    assert moved == pytest.approx(bend, abs=1e-4)


def test_where_the_shift_turns_back_vertices_stay_behind_the_foremost(source):
    curve = source.curves["left", "anterior"]
    own = np.searchsorted(source.halves["anterior"].vertex_of, curve.vertices)
    shift = shifts(source)
    inner = own[1:-1]
    shift["anterior"][inner] = (0.6 - curve.share[1:-1]) * HEIGHT / PERIMETER  # all to one place
    shares = map_boundaries(source, shift)["left", "anterior"]
    assert shares[1:-1] == pytest.approx(0.6, abs=2e-3)
    assert (np.diff(shares) > 0).all()


def test_without_a_shift_nothing_is_moved_by_sewing(source):
    mapped = map_boundaries(source, shifts(source))
    for half in HALVES:
        gaps = seam_gaps(source, source, half, shifts(source)[half], points_at(source, mapped))
        assert len(gaps) == 5
        assert all(gap == pytest.approx(0, abs=1e-9) for gap in gaps.values())


def test_the_gap_is_how_far_a_half_is_moved_to_meet_the_other(source, target):
    turned = shifts(source, constant=(0.02, 0.0))
    mapped = map_boundaries(source, turned)
    points = points_at(target, mapped)
    hole = target.curves["hole", None]
    share = source.curves["hole", None].share
    sewn = hole.at(share + 0.01)
    for half, shift in (("anterior", 0.02), ("posterior", 0.0)):
        gaps = seam_gaps(source, target, half, turned[half], points)
        away = np.linalg.norm(hole.at(share + shift) - sewn, axis=1)
        assert gaps["hole", None] == pytest.approx(away)
        assert away.max() > 0
        # the outside slides by up to 2 % of the perimeter too, which the corners undo
        longest = max(target.curves[key].length for key in OUTER)
        others = max(gap.max() for key, gap in gaps.items() if key[0] != "hole")
        assert others <= 0.02 * PERIMETER / HEIGHT * longest + 1e-9


def test_both_halves_have_five_curves(source):
    for half in HALVES:
        assert {curve_key(name, half) for name in CURVES} <= set(
            map_boundaries(source, shifts(source))
        )
