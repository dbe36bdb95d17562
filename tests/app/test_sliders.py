import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("PySide6")
from flyreg_gui.sliders import SMOOTHING_SCALE, WEIGHT_SCALE, LogScale

SCALES = [WEIGHT_SCALE, SMOOTHING_SCALE]


@pytest.mark.parametrize("scale", SCALES)
def test_each_position_is_found_again_from_its_value(scale):
    first = 0 if scale.has_zero else 1
    for position in range(first, scale.steps + 1):
        assert scale.position(scale.value(position)) == position


@pytest.mark.parametrize("scale", SCALES)
def test_the_ends_are_exact(scale):
    assert scale.value(1) == scale.low
    assert scale.value(scale.steps) == scale.high


def test_the_left_end_of_the_weight_is_off_and_its_middle_is_1():
    assert WEIGHT_SCALE.value(0) == 0
    assert WEIGHT_SCALE.value_at(0.0) == 0
    assert WEIGHT_SCALE.value((1 + WEIGHT_SCALE.steps) // 2) == 1


@given(st.floats(1e-9, 1e9))
def test_a_value_beyond_the_ends_stands_at_the_nearer_end(value):
    scale = LogScale(0.1, 10.0, 101)
    assert 1 <= scale.position(value) <= 101
    assert 0 <= scale.share(value) <= 1
