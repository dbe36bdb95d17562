import math
from itertools import pairwise

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from flyreg_core.errors import LandmarkError
from flyreg_core.landmarks import CURVES, HALVES, SHARED_CURVES, LandmarkPair, kept_in_order

POINT = (1.0, 2.0, 3.0)


def pair(kind="interior", source=POINT, target=POINT, weight=1.0):
    return LandmarkPair("a", "calyx", kind, None, source, target, weight)


@given(weight=st.floats(0, allow_infinity=False))
def test_any_number_of_at_least_zero_is_a_weight(weight):
    assert pair(weight=weight).weight == weight


@pytest.mark.parametrize("weight", [-1.0, -1e-300, math.nan, math.inf])
def test_anything_else_is_no_weight(weight):
    words = f"the weight of landmark calyx must be 0 or a positive number, not {weight}"
    with pytest.raises(LandmarkError, match=words):
        pair(weight=weight)


@pytest.mark.parametrize("end", ["source", "target"])
@pytest.mark.parametrize("kind", CURVES)
def test_a_landmark_on_a_curve_lies_at_a_share_of_its_length(kind, end):
    assert pair(kind, 0.25, 0.5).is_placed
    with pytest.raises(
        LandmarkError, match=rf"landmark calyx is {kind} but lies at \(1.0, 2.0, 3.0\)"
    ):
        pair(kind, **{"source": 0.25, "target": 0.5, end: POINT})


@pytest.mark.parametrize("end", ["source", "target"])
def test_a_landmark_inside_lies_at_a_point(end):
    with pytest.raises(LandmarkError, match="landmark calyx is interior but lies at"):
        pair(**{end: 0.5})


@pytest.mark.parametrize(
    ("source", "target", "placed"),
    [(POINT, POINT, True), (POINT, None, False), (None, POINT, False), (None, None, False)],
)
def test_a_pair_is_placed_once_both_ends_are_known(source, target, placed):
    assert pair(source=source, target=target).is_placed == placed


def test_the_halves_share_the_curves_along_which_they_meet():
    assert set(SHARED_CURVES) == {"upper", "lower", "hole"}
    assert set(CURVES) - set(SHARED_CURVES) == {"left", "right"}
    assert HALVES == ("anterior", "posterior")


@given(
    targets=st.lists(st.floats(0.01, 0.99), min_size=3, max_size=8, unique=True),
    moved=st.integers(0, 7),
    share=st.floats(-1, 2),
    kind=st.sampled_from(["upper", "hole"]),
)
def test_a_landmark_that_slides_along_its_curve_passes_no_neighbour(targets, moved, share, kind):
    targets = sorted(targets)
    assume(min(b - a for a, b in pairwise(targets)) > 0.01)
    sources = [(k + 1) / (len(targets) + 1) for k in range(len(targets))]
    pairs = [
        LandmarkPair(f"p{k}", f"p{k}", kind, None, source, target)
        for k, (source, target) in enumerate(zip(sources, targets, strict=True))
    ]
    number = moved % len(pairs)
    targets[number] = kept_in_order(share, pairs[number], pairs)
    turns = sum(b < a for a, b in pairwise([*targets, targets[0]]))
    assert turns == 1
    assert 0 <= targets[number] <= 1
    assert kind == "hole" or targets == sorted(targets)


def test_a_landmark_with_room_slides_where_it_is_drawn():
    pair = LandmarkPair("p", "p", "upper", None, 0.5, 0.5)
    assert kept_in_order(0.62, pair, [pair]) == pytest.approx(0.62)
