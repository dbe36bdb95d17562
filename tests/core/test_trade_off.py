import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flyreg_core.cross_validation import SMOOTHINGS, bending_energy, find_spectrum, misfits
from flyreg_core.thin_plate_spline import fit_thin_plate_spline, kernel
from flyreg_core.trade_off import find_trade_off, weighted_squares

SEEDS = st.integers(0, 2**32 - 1)
PLACES = [0, 20, 40, 64]
"""Some of the smoothings."""


def landmarks(seed, count=15):
    rng = np.random.default_rng(seed)
    sources = rng.uniform(-1, 1, (count, 2))
    targets = sources + rng.normal(scale=0.1, size=sources.shape)
    weights = rng.uniform(0.1, 10, count)
    weights[3] = 0.0
    return sources, targets, weights


def lift(places):
    """A surface that is the plane, 100 um to the unit."""
    return 100 * np.column_stack([places, np.zeros(len(places))])


def trade_off(*halves):
    spectra = [find_spectrum(*half) for half in halves]
    squares = [
        weighted_squares(spectrum, half[1], lift(half[1]), lift)
        for spectrum, half in zip(spectra, halves, strict=True)
    ]
    return find_trade_off(spectra, squares)


@given(seed=SEEDS, smoothing=st.sampled_from([1e-6, 1e-3, 0.1, 10.0]))
def test_misfit_and_bending_energy_are_those_of_the_spline_that_is_fitted(seed, smoothing):
    sources, targets, weights = landmarks(seed)
    spectrum = find_spectrum(sources, targets, weights)
    spline = fit_thin_plate_spline(sources, targets, weights, smoothing)
    used = weights > 0
    missed = misfits(spectrum, smoothing)
    assert np.isnan(missed[~used]).all()
    assert missed[used] == pytest.approx((targets - spline(sources))[used], rel=1e-6, abs=1e-8)
    bending = spline.bending
    energy = np.trace(bending.T @ kernel(sources, sources) @ bending)
    assert bending_energy(spectrum, smoothing) == pytest.approx(energy, rel=1e-5)


def test_the_curve_is_that_of_splines_fitted_one_by_one_in_micrometres():
    halves = [landmarks(seed) for seed in (1, 2)]
    curve = trade_off(*halves)
    weights = np.concatenate([half[2] for half in halves])
    for place in PLACES:
        smoothing = float(SMOOTHINGS[place])
        splines = [fit_thin_plate_spline(*half, smoothing) for half in halves]
        away = np.concatenate(
            [
                np.linalg.norm(lift(spline(half[0])) - lift(half[1]), axis=1)
                for spline, half in zip(splines, halves, strict=True)
            ]
        )
        expected = np.sqrt(weights @ away**2 / weights.sum())
        assert curve.residuals_um[place] == pytest.approx(expected, rel=1e-6, abs=1e-9)
        assert curve.at(smoothing) == (curve.residuals_um[place], curve.energies[place])


@given(seed=SEEDS)
def test_what_bends_less_misses_more(seed):
    curve = trade_off(landmarks(seed))
    assert (np.diff(curve.residuals_um) >= -1e-9).all()
    assert (np.diff(curve.energies) <= 1e-9 * curve.energies[0]).all()


def test_landmarks_that_agree_with_an_affine_map_are_met_without_bending():
    sources, _, weights = landmarks(1)
    curve = trade_off((sources, sources @ [[1.1, 0.1], [-0.2, 0.9]] + 0.3, weights))
    assert curve.residuals_um.max() < 1e-9
    assert curve.energies.max() < 1e-9


def test_beyond_the_scale_the_curve_ends():
    curve = trade_off(landmarks(1))
    assert curve.at(0.0) == (curve.residuals_um[0], curve.energies[0])
    assert curve.at(1e9) == (curve.residuals_um[-1], curve.energies[-1])
