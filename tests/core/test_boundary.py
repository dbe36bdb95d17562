import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flyreg_core.boundary import Curve, curve_key, find_curves
from flyreg_core.cut import PIECES, Dissection
from flyreg_core.errors import TopologyError
from flyreg_core.landmarks import CURVES, HALVES
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.topology import half_edges, unique_edges
from tests.brains import PreparedBrain

SIDES = ("left", "right")
ALL = [
    ("upper", None),
    ("lower", None),
    ("hole", None),
    *((side, half) for side in SIDES for half in HALVES),
]
OPEN = [key for key in ALL if key[0] != "hole"]
SEEDS = st.integers(0, 2**32 - 1)


def sides_of(vertices):
    return {
        tuple(sorted(pair))
        for pair in zip(vertices[:-1].tolist(), vertices[1:].tolist(), strict=True)
    }


def with_piece(brain, faces, piece):
    """The brain's dissection with some faces given to another piece."""
    pieces = brain.flat.dissection.piece_of_face.copy()
    pieces[faces] = PIECES.index(piece)
    return Dissection(brain.surface, pieces, brain.flat.dissection.cut_knots)


def random_curve(seed, closed=False):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(int(rng.integers(3, 12)), 3))
    start = 0.0
    vertices = np.arange(len(points))
    if closed:
        points[-1], vertices[-1], start = points[0], 0, rng.uniform(-0.5, 0.5)
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return Curve(vertices, start + along / along[-1], points)


def test_there_are_five_curves_for_each_half_three_of_them_shared(demo: PreparedBrain):
    assert set(demo.flat.curves) == set(ALL)
    for half in HALVES:
        assert len({curve_key(name, half) for name in CURVES}) == 5
    assert curve_key("upper", "anterior") == curve_key("upper", "posterior")
    assert curve_key("left", "anterior") != curve_key("left", "posterior")


@pytest.mark.parametrize("half", HALVES)
def test_the_curves_of_a_half_are_its_whole_boundary(demo: PreparedBrain, half):
    edges, counts = unique_edges(demo.flat.dissection.faces_of(half))
    boundary = {tuple(edge) for edge in edges[counts == 1].tolist()}
    found = [sides_of(demo.flat.curves[curve_key(name, half)].vertices) for name in CURVES]
    assert set().union(*found) == boundary
    assert sum(map(len, found)) == len(boundary)


@pytest.mark.parametrize("half", HALVES)
def test_the_sides_of_a_half_meet_in_four_corners(demo: PreparedBrain, half):
    upper, lower, left, right = (
        demo.flat.curves[curve_key(name, half)].vertices
        for name in ("upper", "lower", "left", "right")
    )
    assert upper[0] == right[0]
    assert upper[-1] == left[0]
    assert lower[0] == right[-1]
    assert lower[-1] == left[-1]
    assert len({int(v) for v in (upper[0], upper[-1], lower[0], lower[-1])}) == 4


def test_upper_lies_above_lower_and_both_run_from_right_to_left(demo: PreparedBrain):
    upper, lower = (
        demo.torus.frame.coordinates(demo.flat.curves[name, None].points)
        for name in ("upper", "lower")
    )
    assert upper[:, 1].mean() < lower[:, 1].mean()
    for points in (upper, lower):
        assert points[0, 0] == points[:, 0].min()
        assert points[-1, 0] == points[:, 0].max()


def test_left_and_right_lie_at_their_trim_planes_and_run_downwards(demo: PreparedBrain):
    for half in HALVES:
        for side in SIDES:
            points = demo.torus.frame.coordinates(demo.flat.curves[side, half].points)
            plane = getattr(demo.torus.planes, side)
            assert points[:, 0] == pytest.approx(plane, abs=demo.torus.pitch)
            assert points[0, 1] < points[-1, 1]


@pytest.mark.parametrize("key", ALL)
def test_shares_are_those_of_the_length_along_the_curve(demo: PreparedBrain, key):
    curve = demo.flat.curves[key]
    steps = np.linalg.norm(np.diff(demo.surface.vertices[curve.vertices], axis=0), axis=1)
    assert np.array_equal(curve.points, demo.surface.vertices[curve.vertices])
    assert np.diff(curve.share) == pytest.approx(steps / steps.sum())
    assert curve.length == pytest.approx(steps.sum())
    assert (np.diff(curve.share) > 0).all()
    if key[0] != "hole":
        assert (curve.share[0], curve.share[-1]) == (0, pytest.approx(1))


def test_only_the_hole_is_closed(demo: PreparedBrain):
    assert [key for key in ALL if demo.flat.curves[key].is_closed] == [("hole", None)]


def test_the_hole_starts_at_its_top_and_turns_towards_the_left(demo: PreparedBrain):
    hole = demo.flat.curves["hole", None]
    top, left, bottom, right = hole.at(np.array([0.0, 0.25, 0.5, 0.75]))
    middle, extent = hole.points.mean(axis=0), np.ptp(hole.points, axis=0)
    assert top[1] < middle[1] - 0.2 * extent[1]
    assert bottom[1] > middle[1] + 0.2 * extent[1]
    assert left[0] > middle[0] + 0.2 * extent[0]
    assert right[0] < middle[0] - 0.2 * extent[0]


def test_the_curves_do_not_depend_on_how_vertices_are_numbered(demo: PreparedBrain):
    order = np.random.default_rng(1).permutation(len(demo.surface.vertices))
    renumbered = SurfaceMesh(demo.surface.vertices[order], np.argsort(order)[demo.surface.faces])
    before = demo.flat.dissection
    dissection = Dissection(renumbered, before.piece_of_face, before.cut_knots)
    shares = np.linspace(0, 1, 17)
    for key, curve in find_curves(dissection, demo.torus.frame).items():
        away = curve.at(shares) - demo.flat.curves[key].at(shares)
        assert np.abs(away).max() < 1e-9 * demo.surface.diagonal


@pytest.mark.parametrize("key", ALL)
def test_at_its_own_shares_a_curve_has_its_own_points(demo: PreparedBrain, key):
    curve = demo.flat.curves[key]
    assert curve.at(curve.share) == pytest.approx(curve.points, abs=1e-9 * demo.surface.diagonal)


@given(seed=SEEDS, share=st.floats(0, 1))
def test_a_share_of_an_open_curve_is_reached_after_that_share_of_its_length(seed, share):
    curve = random_curve(seed)
    point = curve.at(np.array([share]))[0]
    step = np.linalg.norm(np.diff(curve.points, axis=0), axis=1)
    before = int(np.searchsorted(curve.share, share, side="right")) - 1
    walked = step[:before].sum() + np.linalg.norm(point - curve.points[before])
    assert walked == pytest.approx(share * curve.length)


@given(seed=SEEDS, share=st.floats(-2, 2), turns=st.integers(-3, 3))
def test_a_closed_curve_goes_on_after_a_turn(seed, share, turns):
    curve = random_curve(seed, closed=True)
    one, other = curve.at(np.array([share, share + turns]))
    assert other == pytest.approx(one, abs=1e-6)
    assert curve.at(curve.share[:1])[0] == pytest.approx(curve.points[0])


def test_a_half_with_a_hole_too_many_is_told(demo_source: PreparedBrain):
    anterior = np.flatnonzero(demo_source.flat.dissection.piece_of_face == 0)
    faces = demo_source.surface.faces
    on_boundary = np.isin(faces, faces[demo_source.flat.dissection.piece_of_face != 0]).any(axis=1)
    inner = anterior[~on_boundary[anterior]][0]
    words = (
        "the anterior half has 1 boundaries at the trim openings and 2 in the oesophagus instead "
        "of one each; move the cut height or the trim planes"
    )
    with pytest.raises(TopologyError, match=words):
        find_curves(with_piece(demo_source, [inner], "posterior"), demo_source.torus.frame)


def test_a_trim_opening_that_the_cut_passes_twice_is_told(demo_source: PreparedBrain):
    rim = demo_source.flat.curves["right", "anterior"].vertices
    middle = sides_of(rim[len(rim) // 2 :][:2])
    cap = np.flatnonzero(demo_source.flat.dissection.piece_of_face == PIECES.index("right cap"))
    directed = np.sort(half_edges(demo_source.surface.faces[cap]), axis=1)
    at = next(k for k, pair in enumerate(directed.tolist()) if tuple(pair) in middle) % len(cap)
    words = (
        "the outside of the anterior half has 6 sides instead of 4: the cut must pass each trim "
        "opening once; move the cut height or the trim planes"
    )
    with pytest.raises(TopologyError, match=words):
        find_curves(with_piece(demo_source, [cap[at]], "posterior"), demo_source.torus.frame)


@given(seed=SEEDS, is_closed=st.booleans(), share=st.floats(0, 1))
def test_a_place_of_a_curve_is_nearest_to_itself(seed, is_closed, share):
    curve = random_curve(seed, is_closed)
    point = curve.at(np.array([share]))[0]
    found, away = curve.nearest(point)
    assert away == pytest.approx(0, abs=1e-9)
    assert curve.at(np.array([found]))[0] == pytest.approx(point, abs=1e-8)


@given(seed=SEEDS)
def test_no_place_of_a_curve_is_nearer_than_the_nearest(seed):
    curve = random_curve(seed)
    point = np.random.default_rng(seed).normal(size=3)
    share, away = curve.nearest(point)
    everywhere = np.linalg.norm(curve.at(np.linspace(0, 1, 2001)) - point, axis=1)
    assert away <= everywhere.min() + 1e-9
    assert np.linalg.norm(curve.at(np.array([share]))[0] - point) == pytest.approx(away, abs=1e-9)
