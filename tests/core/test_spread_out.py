import numpy as np

from flyreg_core.spread_out import spread_out


def test_points_are_spread_out():
    line = np.column_stack([np.arange(101.0), np.zeros(101), np.zeros(101)])
    assert sorted(spread_out(line, 5)) == [0, 25, 50, 75, 100]
    assert len(spread_out(line, 500)) == 101
