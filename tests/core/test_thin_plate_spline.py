import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import RBFInterpolator

from flyreg_core.errors import LandmarkError
from flyreg_core.thin_plate_spline import fit_thin_plate_spline, kernel

SEEDS = st.integers(0, 2**32 - 1)
DIMENSIONS = st.sampled_from([2, 3])
SMOOTHINGS = st.sampled_from([0.0, 1e-6, 1e-3, 0.1, 10.0])
COUNT = 20


def landmarks(seed, dimensions, count=COUNT):
    """Sources, targets near them, weights, and points to ask at."""
    rng = np.random.default_rng(seed)
    sources = rng.uniform(-1, 1, (count, dimensions))
    targets = sources + rng.normal(scale=0.1, size=sources.shape)
    return sources, targets, rng.uniform(0.1, 10, count), rng.uniform(-1.5, 1.5, (30, dimensions))


def affine(seed, points):
    rng = np.random.default_rng(seed)
    d = points.shape[1]
    return points @ rng.normal(size=(d, d)) + rng.normal(size=d)


def objective(spline, targets, weights, smoothing):
    """What the fit makes least: weighted misfit and bending of the given spline."""
    misfit = ((spline(spline.centers) - targets) ** 2).sum(axis=1)
    matrix = kernel(spline.centers, spline.centers)
    return weights @ misfit + smoothing * np.trace(spline.bending.T @ matrix @ spline.bending)


@given(seed=SEEDS, dimensions=DIMENSIONS, smoothing=SMOOTHINGS)
def test_affine_maps_are_reproduced_for_every_smoothing_and_weight(seed, dimensions, smoothing):
    sources, _, weights, points = landmarks(seed, dimensions)
    spline = fit_thin_plate_spline(sources, affine(seed, sources), weights, smoothing)
    assert spline(points) == pytest.approx(affine(seed, points), abs=1e-8)


@given(seed=SEEDS, dimensions=DIMENSIONS)
def test_without_smoothing_every_landmark_is_met(seed, dimensions):
    sources, targets, weights, _ = landmarks(seed, dimensions)
    spline = fit_thin_plate_spline(sources, targets, weights, 0.0)
    assert spline(sources) == pytest.approx(targets, abs=1e-8)


@given(seed=SEEDS, smoothing=SMOOTHINGS)
def test_in_the_plane_the_spline_agrees_with_another_library(seed, smoothing):
    sources, targets, weights, points = landmarks(seed, 2)
    spline = fit_thin_plate_spline(sources, targets, weights, smoothing)
    # its kernel is r^2 log r, half of r^2 log r^2
    other = RBFInterpolator(
        sources, targets, smoothing=smoothing / weights / 2, kernel="thin_plate_spline", degree=1
    )
    assert spline(points) == pytest.approx(other(points), abs=1e-7)


@given(seed=SEEDS, smoothing=SMOOTHINGS)
def test_in_space_the_spline_agrees_with_another_library(seed, smoothing):
    sources, targets, weights, points = landmarks(seed, 3)
    spline = fit_thin_plate_spline(sources, targets, weights, smoothing)
    other = RBFInterpolator(
        sources, targets, smoothing=smoothing / weights, kernel="linear", degree=1
    )
    assert spline(points) == pytest.approx(other(points), abs=1e-7)


@given(seed=SEEDS, dimensions=DIMENSIONS)
def test_more_smoothing_never_fits_the_landmarks_better(seed, dimensions):
    sources, targets, weights, _ = landmarks(seed, dimensions)
    misfit = []
    for smoothing in (0, 1e-4, 1e-3, 1e-2, 0.1, 1, 10, 100):
        away = fit_thin_plate_spline(sources, targets, weights, smoothing)(sources) - targets
        misfit.append(weights @ (away**2).sum(axis=1))
    assert all(less <= more + 1e-9 for less, more in itertools.pairwise(misfit))
    assert misfit[-1] > 1e-3


@given(seed=SEEDS, dimensions=DIMENSIONS)
def test_very_much_smoothing_leaves_the_weighted_affine_fit(seed, dimensions):
    sources, targets, weights, points = landmarks(seed, dimensions)
    spline = fit_thin_plate_spline(sources, targets, weights, 1e9)
    root = np.sqrt(weights)[:, None]
    columns = np.column_stack([sources, np.ones(COUNT)])
    fit = np.linalg.lstsq(root * columns, root * targets, rcond=None)[0]
    expected = np.column_stack([points, np.ones(len(points))]) @ fit
    assert spline(points) == pytest.approx(expected, abs=1e-5)


@given(seed=SEEDS, dimensions=DIMENSIONS, smoothing=SMOOTHINGS)
def test_a_landmark_of_weight_zero_is_left_out(seed, dimensions, smoothing):
    sources, targets, weights, points = landmarks(seed, dimensions)
    weights[[0, 7]] = 0.0
    used = weights > 0
    one = fit_thin_plate_spline(sources, targets, weights, smoothing)
    other = fit_thin_plate_spline(sources[used], targets[used], weights[used], smoothing)
    assert one(points) == pytest.approx(other(points), abs=1e-10)


@given(seed=SEEDS, dimensions=DIMENSIONS, smoothing=st.sampled_from([1e-3, 0.1, 10.0]))
def test_a_landmark_of_weight_two_counts_as_two(seed, dimensions, smoothing):
    sources, targets, weights, points = landmarks(seed, dimensions)
    weights[0], weights[1:] = 2.0, 1.0
    twice = np.append(np.arange(COUNT), 0)
    one = fit_thin_plate_spline(sources, targets, weights, smoothing)
    other = fit_thin_plate_spline(sources[twice], targets[twice], np.ones(COUNT + 1), smoothing)
    assert one(points) == pytest.approx(other(points), abs=1e-8)


@given(seed=SEEDS, dimensions=DIMENSIONS, smoothing=SMOOTHINGS)
def test_the_order_of_the_landmarks_does_not_matter(seed, dimensions, smoothing):
    sources, targets, weights, points = landmarks(seed, dimensions)
    order = np.random.default_rng(seed).permutation(COUNT)
    one = fit_thin_plate_spline(sources, targets, weights, smoothing)
    other = fit_thin_plate_spline(sources[order], targets[order], weights[order], smoothing)
    assert one(points) == pytest.approx(other(points), abs=1e-8)


@given(seed=SEEDS, dimensions=DIMENSIONS)
def test_more_weight_brings_the_spline_closer_to_a_landmark(seed, dimensions):
    sources, targets, weights, _ = landmarks(seed, dimensions)
    away = []
    for weight in (0.01, 0.1, 1.0, 10.0, 100.0):
        weights[3] = weight
        spline = fit_thin_plate_spline(sources, targets, weights, 0.1)
        away.append(np.linalg.norm(spline(sources[3:4]) - targets[3]))
    assert all(less < more for more, less in itertools.pairwise(away))


@given(seed=SEEDS, dimensions=DIMENSIONS, smoothing=st.sampled_from([1e-3, 0.1, 10.0]))
def test_no_other_spline_has_less_weighted_misfit_and_bending(seed, dimensions, smoothing):
    sources, targets, weights, _ = landmarks(seed, dimensions)
    spline = fit_thin_plate_spline(sources, targets, weights, smoothing)
    least = objective(spline, targets, weights, smoothing)
    rng = np.random.default_rng(seed)
    columns = np.column_stack([np.ones(COUNT), sources])
    for size in (1e-3, 1e-1):
        bump = size * rng.normal(size=spline.bending.shape)
        bump -= columns @ np.linalg.lstsq(columns, bump, rcond=None)[0]  # keeps the bending finite
        tilt = size * rng.normal(size=spline.affine.shape)
        other = type(spline)(spline.centers, spline.bending + bump, spline.affine + tilt)
        assert objective(other, targets, weights, smoothing) > least


@given(seed=SEEDS, dimensions=DIMENSIONS, smoothing=SMOOTHINGS)
def test_the_bumps_have_no_affine_part(seed, dimensions, smoothing):
    sources, targets, weights, _ = landmarks(seed, dimensions)
    spline = fit_thin_plate_spline(sources, targets, weights, smoothing)
    scale = np.abs(spline.bending).max() + 1
    assert spline.bending.sum(axis=0) == pytest.approx(0, abs=1e-9 * scale)
    assert sources.T @ spline.bending == pytest.approx(0, abs=1e-9 * scale)


@given(seed=SEEDS, dimensions=DIMENSIONS)
def test_a_kernel_that_is_known_already_gives_the_same_points(seed, dimensions):
    sources, targets, weights, points = landmarks(seed, dimensions)
    spline = fit_thin_plate_spline(sources, targets, weights, 1e-3)
    known = kernel(points, spline.centers)
    assert np.array_equal(spline.from_kernel(known, points), spline(points))


def test_the_kernel_is_that_of_the_paper_in_the_plane_and_minus_r_in_space():
    assert kernel(np.array([[3.0, 4.0]]), np.array([[0.0, 0.0], [3.0, 4.0]])).tolist() == [
        [pytest.approx(25 * np.log(25)), 0.0]
    ]
    assert kernel(np.array([[2.0, 3.0, 6.0]]), np.zeros((1, 3))).tolist() == [[-7.0]]


def test_three_landmarks_in_the_plane_are_enough():
    sources = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    spline = fit_thin_plate_spline(sources, sources + 1, np.ones(3), 0.0)
    assert spline(np.array([[5.0, 7.0]])) == pytest.approx(np.array([[6.0, 8.0]]))


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_landmarks_on_one_line_are_refused(count):
    on_line = np.column_stack([np.arange(count), 2.0 * np.arange(count)])
    with pytest.raises(
        LandmarkError, match="the landmarks in use lie on one line; add one beside it"
    ):
        fit_thin_plate_spline(on_line, on_line, np.ones(count), 1e-3)


def test_a_landmark_beside_the_line_does_not_help_if_it_is_not_in_use():
    sources = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [0.0, 1.0]])
    fit_thin_plate_spline(sources, sources, np.ones(4), 0.0)
    with pytest.raises(LandmarkError, match="lie on one line"):
        fit_thin_plate_spline(sources, sources, np.array([1.0, 1.0, 1.0, 0.0]), 0.0)


def test_landmarks_in_one_plane_are_refused_in_space():
    sources, targets, weights, _ = landmarks(1, 3)
    sources[:, 2] = 4.0
    with pytest.raises(LandmarkError, match="the landmarks in use lie"):
        fit_thin_plate_spline(sources, targets, weights, 1e-3)


def test_two_landmarks_at_one_place_need_smoothing():
    sources, targets, weights, _ = landmarks(1, 2)
    sources[4] = sources[5]
    with pytest.raises(
        LandmarkError,
        match="two landmarks in use lie at the same place; raise lambda or drop one",
    ):
        fit_thin_plate_spline(sources, targets, weights, 0.0)
    assert np.isfinite(fit_thin_plate_spline(sources, targets, weights, 1e-3)(sources)).all()
    weights[5] = 0.0
    assert np.isfinite(fit_thin_plate_spline(sources, targets, weights, 0.0)(sources)).all()


@pytest.mark.parametrize("weight", [-1.0, np.nan, np.inf])
def test_a_weight_is_a_number_of_at_least_zero(weight):
    sources, targets, weights, _ = landmarks(1, 2)
    weights[2] = weight
    with pytest.raises(
        LandmarkError, match="a weight is negative or not a number; use 0 to leave a landmark out"
    ):
        fit_thin_plate_spline(sources, targets, weights, 1e-3)


@pytest.mark.parametrize("smoothing", [-0.5, np.nan, np.inf])
def test_the_smoothing_is_a_number_of_at_least_zero(smoothing):
    sources, targets, weights, _ = landmarks(1, 2)
    with pytest.raises(
        LandmarkError, match=f"the smoothing must be 0 or a positive number, not {smoothing}"
    ):
        fit_thin_plate_spline(sources, targets, weights, smoothing)


def test_every_source_needs_its_target():
    sources, targets, weights, _ = landmarks(1, 2)
    with pytest.raises(LandmarkError, match="20 source landmarks but 19 target landmarks"):
        fit_thin_plate_spline(sources, targets[1:], weights, 1e-3)
