import numpy as np
import pytest

from flyreg_core.boundary import curve_key
from flyreg_core.halves import along_outer
from flyreg_core.landmarks import CURVES, HALVES
from flyreg_core.orientation import orientations, signed_areas
from flyreg_core.rectangle import HEIGHT, HOLE, WIDTH
from tests.brains import PreparedBrain

X, Y = WIDTH / 2, HEIGHT / 2


def places_of(brain, half, name):
    """Where the vertices of a curve are shown in a half's rectangle."""
    flat = brain.flat.halves[half]
    own = {int(vertex): k for k, vertex in enumerate(flat.vertex_of)}
    return flat.plane[[own[int(v)] for v in brain.flat.curves[curve_key(name, half)].vertices]]


@pytest.mark.parametrize("half", HALVES)
def test_no_face_of_a_half_is_flipped_or_loses_its_area(demo: PreparedBrain, half):
    assert (orientations(demo.flat.halves[half].flat.corners) == 1).all()


@pytest.mark.parametrize("half", HALVES)
def test_a_half_covers_its_strip_once(demo: PreparedBrain, half):
    assert signed_areas(demo.flat.halves[half].flat.corners).sum() == pytest.approx(1)


@pytest.mark.parametrize("half", HALVES)
def test_a_half_has_the_faces_that_the_cut_gave_it(demo: PreparedBrain, half):
    flat = demo.flat.halves[half]
    assert np.array_equal(flat.vertex_of[flat.faces], demo.flat.dissection.faces_of(half))
    assert (np.diff(flat.vertex_of) > 0).all()


@pytest.mark.parametrize("half", HALVES)
def test_the_corners_of_the_rectangle_are_those_of_the_half(demo: PreparedBrain, half):
    left = X if half == "anterior" else -X  # the posterior half is seen from behind
    upper, lower = places_of(demo, half, "upper"), places_of(demo, half, "lower")
    assert upper[[0, -1]] == pytest.approx(np.array([[-left, Y], [left, Y]]), abs=1e-9)
    assert lower[[0, -1]] == pytest.approx(np.array([[-left, -Y], [left, -Y]]), abs=1e-9)


@pytest.mark.parametrize("half", HALVES)
@pytest.mark.parametrize("name", ["upper", "lower", "left", "right"])
def test_each_side_is_spread_over_its_side_by_arc_length(demo: PreparedBrain, half, name):
    places = places_of(demo, half, name)
    share = demo.flat.curves[curve_key(name, half)].share[:, None]
    assert places == pytest.approx((1 - share) * places[0] + share * places[-1], abs=1e-9)


@pytest.mark.parametrize("half", HALVES)
def test_the_hole_is_the_rectangle_made_smaller(demo: PreparedBrain, half):
    places = places_of(demo, half, "hole") / [X, Y]
    assert np.abs(places).max(axis=1) == pytest.approx(HOLE)


@pytest.mark.parametrize("half", HALVES)
def test_everything_else_lies_between_the_hole_and_the_sides(demo: PreparedBrain, half):
    flat = demo.flat.halves[half]
    size = np.abs(flat.plane / [X, Y]).max(axis=1)
    inner = np.ones(len(size), dtype=bool)
    inner[flat.outer] = inner[flat.hole] = False
    assert size[inner].min() > HOLE
    assert size[inner].max() < 1
    assert ((flat.beta[inner] > 0) & (flat.beta[inner] < 1)).all()


@pytest.mark.parametrize("name", ["upper", "lower", "hole"])
def test_a_curve_that_both_halves_share_is_mirrored_in_the_other(demo: PreparedBrain, name):
    front, back = places_of(demo, "anterior", name), places_of(demo, "posterior", name)
    assert back == pytest.approx(front * [-1, 1], abs=1e-9)


@pytest.mark.parametrize("half", HALVES)
def test_half_of_the_area_of_a_half_has_half_of_the_room(demo: PreparedBrain, half):
    flat = demo.flat.halves[half]
    corners = demo.surface.vertices[flat.vertex_of[flat.faces]]
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    size = np.abs(flat.plane / [X, Y]).max(axis=1)[flat.faces].mean(axis=1)
    inner = size**2 < (1 + HOLE**2) / 2
    assert areas[inner].sum() / areas.sum() == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("half", HALVES)
def test_the_outside_is_run_around_once_clockwise_from_the_upper_right_corner(demo, half):
    key = {curve_key(name, half): demo.flat.curves[curve_key(name, half)] for name in CURVES}
    around = along_outer(half, {k: curve.vertices for k, curve in key.items()})
    flat = demo.flat.halves[half]
    assert np.array_equal(flat.vertex_of[flat.outer], around)
    assert len(set(around.tolist())) == len(around)
    assert around[0] == key["upper", None].vertices[0]
    assert (np.diff(flat.outer_share) > 0).all()
    assert (flat.outer_share[0], flat.outer_share[-1] < 1) == (0, True)
    x, y = (
        demo.surface.vertices[around, axis] - demo.surface.vertices[around, axis].mean()
        for axis in (0, 1)
    )
    turned = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    assert turned > 0  # clockwise as the front is looked at: left is right, and y runs down
