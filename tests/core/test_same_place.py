"""One place everywhere: what the cursor shows agrees with what the registration does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core.landmarks import HALVES
from flyreg_core.rectangle import from_plane
from flyreg_core.same_place import PlaceFinder, SurfacePlace

SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=15)


@pytest.fixture(scope="module")
def finder(demo_source, demo_target, demo_registration):
    return PlaceFinder(demo_source.flat, demo_target.flat, demo_registration)


def random_place(rng, surface):
    return SurfacePlace(int(rng.integers(len(surface.faces))), rng.dirichlet(np.ones(3)))


@FEW
@given(seed=SEEDS)
def test_from_the_source_to_the_target_and_back_is_the_same_place(seed, finder, demo_source):
    rng = np.random.default_rng(seed)
    for _ in range(20):
        start = random_place(rng, demo_source.surface)
        there = finder.from_source(start)
        if there.half is None:  # caps go by nearest points, which need not be each other's
            continue
        back = finder.from_target(there.target)
        away = back.source.on(demo_source.surface) - start.on(demo_source.surface)
        assert np.linalg.norm(away) < 1e-3
        assert there.half == back.half
        np.testing.assert_allclose(back.plane, there.plane, atol=1e-6)


def test_a_vertex_has_its_place_where_the_registration_put_it(
    finder, demo_source, demo_target, demo_registration
):
    """The other route: registered vertices come from the lift, not from here."""
    faces = demo_source.surface.faces
    rng = np.random.default_rng(0)
    boundary = {int(v) for curve in demo_source.flat.curves.values() for v in curve.vertices}
    checked = 0
    for face in rng.choice(len(faces), 300, replace=False):
        for corner in range(3):
            vertex = faces[face, corner]
            same = finder.from_source(SurfacePlace(int(face), np.eye(3)[corner]))
            if same.half is None or int(vertex) in boundary:
                continue
            expected = demo_registration.surface.vertices[vertex]
            got = same.target.on(demo_target.surface)
            assert np.linalg.norm(got - expected) < 1e-6
            checked += 1
    assert checked > 500


def test_places_on_caps_are_the_nearest_ones(finder, demo_source, demo_target, demo_registration):
    pieces = demo_source.flat.dissection.piece_of_face
    for face in np.flatnonzero(pieces >= len(HALVES))[::5]:
        place = SurfacePlace(int(face), np.full(3, 1 / 3))
        same = finder.from_source(place)
        assert same.half is None
        assert same.plane is None
        moved = place.on(demo_registration.surface)
        nearest = demo_target.surface.tree.nearest(moved[None])[0][0]
        away = same.target.on(demo_target.surface) - moved
        assert np.dot(away, away) == pytest.approx(nearest, abs=1e-9)


@FEW
@given(seed=SEEDS)
def test_a_place_of_the_rectangle_is_drawn_where_it_was_pointed_at(seed, finder):
    rng = np.random.default_rng(seed)
    for half in HALVES:
        points = rng.uniform([-1.6, -1.1], [1.6, 1.1], (20, 2))
        _, beta = from_plane(points)
        for point, share in zip(points, beta, strict=True):
            same = finder.from_plane(half, point)
            if not 0 <= share <= 1:
                assert same is None
                continue
            assert same.half == half
            np.testing.assert_allclose(same.plane, point, atol=1e-3)


def test_what_is_the_same_brain_is_not_sorted_again(
    finder, demo_source, demo_target, demo_registration
):
    again = PlaceFinder(demo_source.flat, demo_target.flat, demo_registration, finder)
    assert again._target is finder._target
    assert again._source is finder._source
