"""The spline under the hand: whatever is touched in whatever order, it is what a new solution gives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core.errors import Cancelled, LandmarkError
from flyreg_core.live_spline import MOST_CHANGED, LiveSpline
from flyreg_core.progress import ignore
from flyreg_core.smoothing_table import LEAST_SMOOTHING, MOST_SMOOTHING
from flyreg_core.thin_plate_spline import fit_thin_plate_spline

EQUAL = 1e-6
"""Of the domain's width, which is 2 here."""
COUNT = 30
SEEDS = st.integers(0, 2**32 - 1)
WEIGHTS = st.sampled_from([0.0, 0.01, 0.5, 1.0, 7.0, 100.0])
SMOOTHINGS = st.sampled_from([0.0, 1e-6, 1e-4, 3e-3, 0.2, 10.0, 1e3])
ROWS = st.integers(0, COUNT - 1)
EDITS = st.one_of(
    st.tuples(st.just("weight"), ROWS, WEIGHTS),
    st.tuples(st.just("weights"), st.lists(ROWS, min_size=2, max_size=COUNT), WEIGHTS),
    st.tuples(st.just("target"), ROWS, st.floats(-0.2, 0.2)),
    st.tuples(st.just("source"), ROWS, st.floats(-0.2, 0.2)),
    st.tuples(st.just("smoothing"), SMOOTHINGS, st.none()),
    st.tuples(st.just("drop"), ROWS, st.none()),
    st.tuples(st.just("add"), st.floats(-1, 1), st.floats(-1, 1)),
)


class Landmarks:
    """Landmarks that a hand changes, and points at which their spline is asked for."""

    def __init__(self, seed: int, count: int = COUNT) -> None:
        rng = np.random.default_rng(seed)
        self.points = rng.uniform(-1, 1, (200, 2))
        self.sources = rng.uniform(-1, 1, (count, 2))
        self.targets = self.sources + rng.normal(0, 0.1, (count, 2))
        self.weights, self.smoothing = np.ones(count), 1e-2

    def edit(self, what, first, second):
        """Do one thing that a user can do."""
        row = first % len(self.sources) if isinstance(first, int) else None
        if what == "weight":
            self.weights = np.where(np.arange(len(self.weights)) == row, second, self.weights)
        elif what == "weights":
            chosen = np.isin(np.arange(len(self.weights)), first)
            self.weights = np.where(chosen, second, self.weights)
        elif what == "smoothing":
            self.smoothing = first
        elif what == "add":
            self.sources = np.vstack([self.sources, [first, second]])
            self.targets = np.vstack([self.targets, [first + 0.05, second]])
            self.weights = np.append(self.weights, 1.0)
        elif what == "drop":
            kept = np.arange(len(self.sources)) != row
            self.sources, self.targets = self.sources[kept], self.targets[kept]
            self.weights = self.weights[kept]
        else:
            moved = getattr(self, f"{what}s").copy()
            moved[row] += [second, -second / 2]
            setattr(self, f"{what}s", moved)

    def ask(self, live):
        return live(self.sources, self.targets, self.weights, self.smoothing, ignore)

    def solve_anew(self):
        return fit_thin_plate_spline(self.sources, self.targets, self.weights, self.smoothing)


def check(live: LiveSpline, marks: Landmarks) -> None:
    """The answer is that of a new solution, or the same refusal."""
    try:
        expected = marks.solve_anew()
    except LandmarkError as refusal:
        with pytest.raises(LandmarkError, match=str(refusal)):
            marks.ask(live)
        return
    assert np.abs(marks.ask(live) - expected(marks.points)).max() < EQUAL


@given(seed=SEEDS, steps=st.lists(EDITS, max_size=12))
@settings(max_examples=150)
def test_after_any_edits_the_answer_is_that_of_a_new_solution(seed, steps):
    marks = Landmarks(seed)
    live = LiveSpline(marks.points)
    check(live, marks)
    for step in steps:
        marks.edit(*step)
        check(live, marks)


@given(seed=SEEDS, steps=st.lists(EDITS, max_size=6))
@settings(max_examples=30)
def test_it_is_the_same_where_the_kernel_is_too_large_to_keep(seed, steps):
    marks = Landmarks(seed)
    live = LiveSpline(marks.points, most_bytes=0)
    for step in steps:
        marks.edit(*step)
        check(live, marks)


def test_ten_thousand_ticks_do_not_drift():
    marks, rng = Landmarks(1, 12), np.random.default_rng(2)
    live = LiveSpline(marks.points)
    for _ in range(10_000):
        row = int(rng.integers(12))
        kind = rng.integers(10)
        if kind < 6:
            marks.edit("weight", row, float(rng.choice([0.0, 0.01, 1.0, 30.0])))
        elif kind < 9:
            marks.edit("target", row, float(rng.uniform(-0.01, 0.01)))
        else:
            marks.edit("smoothing", float(10 ** rng.uniform(-6, 1)), None)
        if (marks.weights > 0).sum() < 5:
            marks.weights = np.ones(12)
        marks.ask(live)
    check(live, marks)


def test_more_landmarks_than_can_be_corrected_for_are_solved_anew():
    marks = Landmarks(3, MOST_CHANGED + 20)
    live = LiveSpline(marks.points)
    check(live, marks)
    marks.weights = np.linspace(0.5, 2.0, len(marks.weights))
    check(live, marks)


@given(seed=SEEDS, at=st.lists(st.floats(0, 1), min_size=1, max_size=8))
@settings(max_examples=30)
def test_a_whole_drag_of_the_smoothing_is_right_everywhere(seed, at):
    marks = Landmarks(seed, 60)
    marks.weights = 10.0 ** np.random.default_rng(seed).uniform(-2, 2, 60)
    live = LiveSpline(marks.points)
    check(live, marks)
    for share in [0.0, 1.0, *at]:
        smoothing = LEAST_SMOOTHING * (MOST_SMOOTHING / LEAST_SMOOTHING) ** share
        marks.edit("smoothing", float(np.clip(smoothing, LEAST_SMOOTHING, MOST_SMOOTHING)), None)
        check(live, marks)


@given(seed=SEEDS)
@settings(max_examples=20)
def test_landmarks_at_one_place_count_each(seed):
    marks = Landmarks(seed)
    marks.edit("add", *marks.sources[3].tolist())
    live = LiveSpline(marks.points)
    check(live, marks)
    marks.edit("weight", COUNT, 5.0)
    check(live, marks)
    marks.edit("drop", 3, None)
    check(live, marks)


def test_the_order_of_landmarks_does_not_matter():
    marks, order = Landmarks(5), np.random.default_rng(5).permutation(COUNT)
    live = LiveSpline(marks.points)
    marks.edit("weight", 4, 9.0)
    values = marks.ask(live)
    shuffled = (marks.sources[order], marks.targets[order], marks.weights[order], marks.smoothing)
    assert np.abs(values - live(*shuffled, ignore)).max() < EQUAL


def test_an_answer_that_was_given_stays_as_it_was():
    marks = Landmarks(6)
    live = LiveSpline(marks.points)
    values = marks.ask(live)
    before = values.copy()
    marks.edit("weight", 4, 9.0)
    second = marks.ask(live)
    marks.edit("smoothing", 0.5, None)
    marks.ask(live)
    assert np.array_equal(values, before)
    assert not np.array_equal(second, before)


def test_evaluating_anew_can_be_cancelled():
    def cancel(fraction: float, text: str) -> None:
        raise Cancelled

    marks = Landmarks(7)
    with pytest.raises(Cancelled):
        LiveSpline(marks.points, most_bytes=0)(
            marks.sources, marks.targets, marks.weights, 0.1, cancel
        )
