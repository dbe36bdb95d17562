"""How the halves meet: theorems about the angle across the seam, and about the hole's curve."""

import itertools

import numpy as np
import pytest

from flyreg_core.landmarks import HALVES
from flyreg_core.seam import (
    AlongCurve,
    angles_across_seam,
    distances_to_chain,
    hole_chain,
    seam_vertices,
)
from tests.frames import random_frame


def vertices_of(brain):
    return brain.surface.vertices


def test_moving_and_turning_a_brain_keeps_its_angles(demo):
    vertices = vertices_of(demo)
    moved = vertices @ np.array(random_frame(4).axes) + [10.0, -20.0, 30.0]
    angles = angles_across_seam(vertices, demo.flat)
    assert len(angles) == len(seam_vertices(demo.flat))
    assert 0 < angles.mean() < 90
    np.testing.assert_allclose(angles_across_seam(moved, demo.flat), angles, atol=1e-6)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0])
def test_halves_that_lie_in_two_planes_meet_at_the_angle_of_the_planes(demo, degrees):
    """A wedge: each half flat, the seam on the edge between them."""
    flat, vertices = demo.flat, np.zeros_like(vertices_of(demo))
    tilt = np.radians(degrees)
    for half, (right, up) in zip(HALVES, ((1.0, 0.0), (np.cos(tilt), -np.sin(tilt))), strict=True):
        own = flat.halves[half]
        away, along = 1 - own.flat.uv[:, 1], own.flat.uv[:, 0]
        sign = 1 if half == "anterior" else -1
        places = np.stack([sign * right * away, along, sign * up * away], axis=1)
        vertices[own.vertex_of] = 1000 * places
    upper = np.isin(seam_vertices(flat), flat.curves["upper", None].vertices[5:-5])
    angles = angles_across_seam(vertices, flat)[upper]
    assert np.median(angles) == pytest.approx(degrees, abs=1.0)


def test_the_registered_surface_turns_at_the_seam_about_as_the_target_does(
    demo_registration, demo_source, demo_target
):
    registered = angles_across_seam(demo_registration.surface.vertices, demo_source.flat)
    target = angles_across_seam(vertices_of(demo_target), demo_target.flat)
    assert np.median(registered) == pytest.approx(np.median(target), abs=5.0)


def test_the_holes_curve_comes_to_lie_on_that_of_the_target(
    demo_registration, demo_source, demo_target
):
    own = hole_chain(demo_registration.surface.vertices, demo_source.flat)
    other = hole_chain(vertices_of(demo_target), demo_target.flat)
    edge = np.linalg.norm(np.diff(other, axis=0), axis=1).max()
    assert distances_to_chain(own, other).max() < edge
    assert distances_to_chain(other, own).max() < edge


def square(size):
    return size * np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0]], dtype=float)


def test_a_curve_is_at_no_distance_from_itself_however_it_is_divided():
    coarse = square(4)
    fine = np.concatenate([np.linspace(a, b, 7) for a, b in itertools.pairwise(coarse)])
    np.testing.assert_allclose(distances_to_chain(fine, coarse), 0, atol=1e-12)
    np.testing.assert_allclose(distances_to_chain(coarse, fine), 0, atol=1e-12)


def test_the_farthest_of_ends_and_middle_counts():
    lifted = square(4) + np.array([0, 0, 3])
    np.testing.assert_allclose(distances_to_chain(square(4), lifted), 3)
    chord = np.array([[0.0, 0, 0], [4, 4, 0]])  # its ends on the square, its middle 2 from it
    np.testing.assert_allclose(distances_to_chain(chord, square(4)), [2])


def test_long_edges_count_more_than_short_ones():
    along = AlongCurve.of(np.array([5.0, 1.0, 3.0]), np.array([1.0, 8.0, 1.0]))
    assert (along.mean, along.p95, along.largest) == (1.6, 5.0, 5.0)
