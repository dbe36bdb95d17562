from dataclasses import replace

import numpy as np
import pytest

from flyreg_core.correspondence import boundary_pairs, place_landmarks
from flyreg_core.landmarks import HALVES, LandmarkPair, LandmarkParameters
from flyreg_core.placements import place_all
from flyreg_core.progress import ignore
from tests.brains import PreparedBrain


@pytest.fixture(scope="module")
def pairs(demo: PreparedBrain):
    flat = demo.flat
    places = [tuple(point) for point in demo.surface.vertices[:: len(demo.surface.vertices) // 12]]
    own = [
        LandmarkPair(f"p{k}", f"p{k}", "interior", None, place, place, weight=0.5)
        for k, place in enumerate(places)
    ]
    return (*boundary_pairs(flat, flat, LandmarkParameters(pairing="arc length")), *own)


def same(one, other):
    """Whether two landmarks have the same places and weights."""
    return (
        one.pair == other.pair
        and np.allclose(one.source_point, other.source_point)
        and np.allclose(one.target_point, other.target_point)
        and one.plane.keys() == other.plane.keys()
        and all(np.allclose(one.plane[half], other.plane[half]) for half in one.plane)
    )


def changed(pairs, row, **changes):
    return (*pairs[:row], replace(pairs[row], **changes), *pairs[row + 1 :])


@pytest.mark.parametrize(
    "edit",
    [
        lambda pairs: pairs,
        lambda pairs: changed(pairs, 3, weight=4.0),
        lambda pairs: changed(pairs, -2, target=pairs[-3].target),
        lambda pairs: changed(pairs, -2, source=pairs[-3].source),
        lambda pairs: changed(pairs, -2, target=None),
        lambda pairs: pairs[:-3],
        lambda pairs: pairs[::-1],
        lambda pairs: changed(pairs, 4, target=0.123),
    ],
)
def test_what_is_kept_is_what_would_be_found_again(demo: PreparedBrain, pairs, edit):
    flat = demo.flat
    before = place_all(flat, flat, pairs, None, ignore)
    after = place_all(flat, flat, edit(pairs), before, ignore)
    fresh = place_landmarks(flat, flat, edit(pairs))
    assert len(after.landmarks) == len(fresh)
    assert all(same(one, other) for one, other in zip(after.landmarks, fresh, strict=True))
    for half in HALVES:
        acting = [mark for mark in fresh if half in mark.plane]
        assert np.allclose(after.geometry.sources[half], [m.plane[half][0] for m in acting])
        assert np.allclose(after.geometry.targets[half], [m.plane[half][1] for m in acting])
        assert after.weights[half].tolist() == [mark.pair.weight for mark in acting]


def test_a_weight_leaves_all_places_as_they_are(demo: PreparedBrain, pairs):
    before = place_all(demo.flat, demo.flat, pairs, None, ignore)
    after = place_all(demo.flat, demo.flat, changed(pairs, 3, weight=4.0), before, ignore)
    assert after.geometry is before.geometry


def test_nothing_is_kept_for_other_brains(demo: PreparedBrain, demo_target, pairs):
    before = place_all(demo.flat, demo.flat, pairs, None, ignore)
    after = place_all(demo.flat, demo_target.flat, pairs, before, ignore)
    fresh = place_landmarks(demo.flat, demo_target.flat, pairs)
    assert all(same(one, other) for one, other in zip(after.landmarks, fresh, strict=True))


def test_a_muted_landmark_keeps_its_weight_and_place_and_does_not_pull(demo: PreparedBrain, pairs):
    before = place_all(demo.flat, demo.flat, pairs, None, ignore)
    row = max(row for row, mark in enumerate(before.landmarks) if mark.plane)  # not on a cap
    after = place_all(demo.flat, demo.flat, pairs, before, ignore, {pairs[row].id})
    assert after.geometry is before.geometry
    assert after.landmarks[row].pair is pairs[row]
    weights = {half: before.weights[half].copy() for half in HALVES}
    (half,) = after.landmarks[row].plane
    weights[half][-1] = 0.0
    assert all(np.array_equal(after.weights[half], weights[half]) for half in HALVES)
    again = place_all(demo.flat, demo.flat, pairs, after, ignore)
    assert again.weights[half].tolist() == before.weights[half].tolist()
