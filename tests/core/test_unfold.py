import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core.errors import Cancelled
from flyreg_core.flatten import FlattenParameters, flatten
from flyreg_core.mesh import FlatMesh
from flyreg_core.orientation import orientations
from flyreg_core.progress import ignore
from flyreg_core.unfold import Net, count_flipped, unfold
from tests.core.test_flatten import random_ring, regular_ring

SEEDS = st.integers(0, 2**32 - 1)
SIZES = st.sampled_from([1e-3, 0.03, 0.3, 3.0])


def moved(flat, uv):
    return FlatMesh(uv, flat.faces, flat.corner_shifts)


def laid(ring, surface):
    flat, springs = flatten(ring, surface.face_areas, FlattenParameters(rounds=1), ignore)
    is_fixed = np.zeros(len(flat.uv), dtype=bool)
    is_fixed[ring.outer] = is_fixed[ring.hole] = True
    return flat, Net(springs, flat.faces), is_fixed


def shaken(seed, size, share=1.0):
    """A random ring laid flat, then a share of its inner vertices pushed about."""
    flat, net, is_fixed = laid(*random_ring(seed))
    rng = np.random.default_rng(seed)
    chosen = ~is_fixed & (rng.uniform(size=len(is_fixed)) < share)
    push = np.where(chosen[:, None], rng.normal(scale=size, size=flat.uv.shape), 0)
    return moved(flat, flat.uv + push), net, is_fixed


@given(seed=SEEDS, size=SIZES, share=st.floats(0, 1))
def test_whatever_folds_is_laid_flat_again(seed, size, share):
    flat, net, is_fixed = shaken(seed, size, share)
    assert count_flipped(unfold(flat, net, is_fixed, ignore).flat) == 0


@given(seed=SEEDS, size=SIZES, share=st.floats(0, 1))
def test_the_boundaries_stay_where_they_are(seed, size, share):
    flat, net, is_fixed = shaken(seed, size, share)
    mended = unfold(flat, net, is_fixed, ignore).flat
    assert np.array_equal(mended.uv[is_fixed], flat.uv[is_fixed])
    assert mended.faces is flat.faces
    assert mended.corner_shifts is flat.corner_shifts


@given(seed=SEEDS)
@settings(max_examples=20)
def test_boundaries_that_slid_along_themselves_are_mended_with_the_rest_kept(seed):
    flat, net, is_fixed = laid(*random_ring(seed))
    uv = flat.uv.copy()
    hole = uv[:, 1] == 0
    uv[hole, 0] += 0.2 + 0.1 * np.sin(2 * np.pi * uv[hole, 0])
    mended = unfold(moved(flat, uv), net, is_fixed, ignore).flat
    assert count_flipped(mended) == 0
    assert np.array_equal(mended.uv[is_fixed], uv[is_fixed])


@given(seed=SEEDS)
@settings(max_examples=20)
def test_where_nothing_is_flipped_nothing_changes(seed):
    flat, net, is_fixed = laid(*random_ring(seed))
    assert unfold(flat, net, is_fixed, ignore).flat is flat


def test_far_from_a_fold_nothing_moves():
    ring, surface, _ = regular_ring(around=60, layers=30)
    flat, net, is_fixed = laid(ring, surface)
    uv = flat.uv.copy()
    pushed = 15 * 60 + 20  # to behind its neighbour
    uv[pushed, 0] -= 1.5 / 60
    mended = unfold(moved(flat, uv), net, is_fixed, ignore).flat
    layer, place = np.divmod(np.arange(len(uv)), 60)
    near = (np.abs(layer - 15) <= 6) & (np.abs(place - 20) <= 6)
    assert count_flipped(moved(flat, uv)) > 0
    assert count_flipped(mended) == 0
    assert np.array_equal(mended.uv[~near], uv[~near])


@given(seed=SEEDS, size=SIZES)
@settings(max_examples=20)
def test_folds_are_counted_exactly(seed, size):
    flat, _, _ = shaken(seed, size)
    assert count_flipped(flat) == int((orientations(flat.corners) != 1).sum())


def test_a_face_without_area_counts_as_flipped():
    uv = np.array([[0.0, 0.0], [0.5, 0.5], [1.0, 1.0]])
    assert count_flipped(FlatMesh(uv, np.array([[0, 1, 2]]), np.zeros((1, 3), dtype=int))) == 1


def test_mending_can_be_cancelled():
    def cancel(fraction, text):
        raise Cancelled

    with pytest.raises(Cancelled):
        unfold(*shaken(1, 0.3), cancel)
