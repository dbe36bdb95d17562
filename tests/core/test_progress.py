import numpy as np
import pytest

from flyreg_core.errors import Cancelled
from flyreg_core.progress import ignore, in_chunks, within

POINTS = np.arange(30.0).reshape(10, 3)


def test_a_part_of_the_work_reports_its_share_of_the_whole():
    told = []
    report = within(lambda fraction, text: told.append((fraction, text)), 0.25, 0.75)
    for fraction in (0.0, 0.5, 1.0):
        report(fraction, "cutting")
    assert told == [(0.25, "cutting"), (0.5, "cutting"), (0.75, "cutting")]


def test_parts_may_have_parts():
    told = []
    outer = within(lambda fraction, text: told.append(fraction), 0.5, 1.0)
    within(outer, 0.5, 1.0)(0.5, "")
    assert told == [0.875]


@pytest.mark.parametrize("size", [1, 3, 10, 11])
def test_asking_in_parts_gives_the_same_answer_in_the_same_order(size):
    answer = in_chunks(lambda points: points.sum(axis=1), POINTS, ignore, "", size)
    assert np.array_equal(answer, POINTS.sum(axis=1))


def test_no_part_is_larger_than_asked_for():
    lengths = []

    def query(points):
        lengths.append(len(points))
        return points

    in_chunks(query, POINTS, ignore, "", 4)
    assert sum(lengths) == 10
    assert max(lengths) <= 4


def test_nothing_asked_gives_nothing():
    answer = in_chunks(lambda points: points.sum(axis=1), POINTS[:0], ignore, "")
    assert answer.shape == (0,)


def test_the_fraction_told_grows_from_nothing_and_stays_below_the_whole():
    told = []
    in_chunks(lambda points: points, POINTS, lambda fraction, _: told.append(fraction), "", 2)
    assert told[0] == 0
    assert all(less < more for less, more in zip(told, [*told[1:], 1.0], strict=True))


def test_cancelling_stops_before_the_next_part():
    asked = []

    def report(fraction, text):
        if asked:
            raise Cancelled

    with pytest.raises(Cancelled):
        in_chunks(lambda points: asked.append(len(points)) or points, POINTS, report, "", 5)
    assert asked == [5]
