import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flyreg_core.cross_validation import (
    AS_GOOD,
    SMOOTHINGS,
    cross_validate,
    find_spectrum,
    leave_one_out,
    leverages,
)
from flyreg_core.thin_plate_spline import affine_basis, fit_thin_plate_spline, kernel

SEEDS = st.integers(0, 2**32 - 1)
SMOOTHING = st.sampled_from([1e-6, 1e-3, 0.1, 10.0])


def landmarks(seed, count=15, noise=0.1):
    rng = np.random.default_rng(seed)
    sources = rng.uniform(-1, 1, (count, 2))
    targets = sources + rng.normal(scale=noise, size=sources.shape)
    weights = rng.uniform(0.1, 10, count)
    weights[3] = 0.0
    return sources, targets, weights


@given(seed=SEEDS, smoothing=SMOOTHING)
def test_leaving_one_out_is_what_fitting_without_it_gives(seed, smoothing):
    sources, targets, weights = landmarks(seed)
    errors = leave_one_out(find_spectrum(sources, targets, weights), smoothing)
    assert np.isnan(errors[3]).all()
    for left_out in (0, 7, 14):
        others = weights.copy()
        others[left_out] = 0.0
        spline = fit_thin_plate_spline(sources, targets, others, smoothing)
        expected = targets[left_out] - spline(sources)[left_out]
        assert errors[left_out] == pytest.approx(expected, rel=1e-6, abs=1e-8)


@given(seed=SEEDS)
def test_the_score_is_that_of_the_matrix_that_smooths(seed):
    sources, targets, weights = landmarks(seed)
    used = weights > 0
    sources, targets, weights = sources[used], targets[used], weights[used]
    scores = cross_validate([find_spectrum(sources, targets, weights)]).scores
    n, root = len(weights), np.sqrt(weights)
    for place in (8, 30, 56):
        system = np.block(
            [
                [
                    kernel(sources, sources) + SMOOTHINGS[place] * np.diag(1 / weights),
                    affine_basis(sources),
                ],
                [affine_basis(sources).T, np.zeros((3, 3))],
            ]
        )
        bending = np.linalg.inv(system)[:n, :n]  # of targets to the weights of the bumps
        rest = SMOOTHINGS[place] * bending / root[:, None] / root[None]  # 1 less what smooths
        misfit = rest @ (root[:, None] * targets)
        expected = n * (misfit**2).sum() / np.trace(rest) ** 2
        assert scores[place] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("seed", range(3))
def test_the_leverage_is_by_how_much_a_target_draws_its_own_image_along(seed):
    sources, targets, weights = landmarks(seed)
    shares = leverages(find_spectrum(sources, targets, weights), 1e-2)
    for number in np.flatnonzero(weights > 0):
        moved = targets.copy()
        moved[number, 0] += 1.0
        before = fit_thin_plate_spline(sources, targets, weights, 1e-2)(sources[[number]])
        after = fit_thin_plate_spline(sources, moved, weights, 1e-2)(sources[[number]])
        assert shares[number] == pytest.approx((after - before)[0, 0], abs=1e-9)
    assert np.isnan(shares[weights == 0]).all()


def test_exact_landmarks_ask_for_no_smoothing_and_noisy_ones_for_some():
    rng = np.random.default_rng(5)
    sources = rng.uniform(-1, 1, (120, 2))
    bent = sources + 0.2 * np.sin(2 * sources[:, ::-1])
    weights = np.ones(120)
    exact = cross_validate([find_spectrum(sources, bent, weights)]).best
    noisy = bent + rng.normal(scale=0.05, size=bent.shape)
    best = cross_validate([find_spectrum(sources, noisy, weights)]).best
    assert exact == SMOOTHINGS[0] < best
    places = rng.uniform(-1, 1, (500, 2))
    truth = places + 0.2 * np.sin(2 * places[:, ::-1])

    def error(smoothing):
        spline = fit_thin_plate_spline(sources, noisy, weights, smoothing)
        return np.linalg.norm(spline(places) - truth, axis=1).mean()

    assert error(best) < 1.2 * min(error(float(smoothing)) for smoothing in SMOOTHINGS)


def test_landmarks_that_agree_with_an_affine_map_have_no_error():
    sources, _, weights = landmarks(1)
    targets = sources @ [[1.1, 0.1], [-0.2, 0.9]] + 0.3
    errors = leave_one_out(find_spectrum(sources, targets, weights), 0.01)
    assert np.nanmax(np.abs(errors)) < 1e-9


def curve(targets_of, seed=3):
    """The cross-validation of 120 landmarks, and the landmarks."""
    rng = np.random.default_rng(seed)
    sources = rng.uniform(-1, 1, (120, 2))
    targets = targets_of(sources, rng)
    return cross_validate([find_spectrum(sources, targets, np.ones(120))]), sources, targets


def bent(sources, _rng):
    return sources + 0.2 * np.sin(2 * sources[:, ::-1])


def bent_and_noisy(sources, rng):
    return bent(sources, rng) + rng.normal(scale=0.05, size=sources.shape)


def nearly_affine(sources, rng):
    return 1.02 * sources + rng.normal(scale=0.01, size=sources.shape)


def test_noisy_landmarks_speak_for_a_smoothing_and_then_for_no_other():
    scores, _, _ = curve(bent_and_noisy)
    advised = scores.advise(1e-6).smoothing
    assert advised == scores.best
    assert scores.advise(advised).smoothing is None
    assert "as well as with any other" in scores.advise(advised).reason


def test_landmarks_that_hardly_bend_speak_for_no_smoothing_that_would_erase_one_of_them():
    """Among 119 that agree with an affine map, what the 120th says alone would be lost."""

    def one_of_its_own(sources, rng):
        targets = nearly_affine(sources, rng)
        targets[0] += 0.03
        return targets

    scores, sources, targets = curve(one_of_its_own)
    assert scores.best == SMOOTHINGS[-1]
    erased = fit_thin_plate_spline(sources, targets, np.ones(120), scores.best)(sources[:1])
    assert np.linalg.norm(erased - targets[0]) > 0.02
    advice = scores.advise(1e-2)
    assert advice.smoothing is None
    assert "to the end of the scale" in advice.reason


def test_landmarks_that_agree_to_rounding_speak_for_no_smoothing():
    scores, _, _ = curve(lambda sources, rng: sources + rng.normal(scale=1e-15, size=sources.shape))
    for present in SMOOTHINGS[::8]:
        advice = scores.advise(present)
        assert advice.smoothing is None
        assert "every smoothing gives the same" in advice.reason


@given(seed=SEEDS, present=SMOOTHING, kind=st.sampled_from([bent_and_noisy, nearly_affine]))
def test_what_is_advised_foretells_clearly_better_than_the_present_smoothing(seed, present, kind):
    scores, _, _ = curve(kind, seed)
    advised = scores.advise(present).smoothing
    if advised is not None:
        assert scores.error_at(advised) == pytest.approx(1.0)
        assert min(scores.error_at(present), scores.error_at(SMOOTHINGS[-1])) >= AS_GOOD
