import numpy as np
import pytest
import trimesh
from flyreg_resources.demo import deform
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core.correspondence import boundary_pairs, place_landmarks
from flyreg_core.landmarks import HALVES, LandmarkPair, LandmarkParameters
from flyreg_core.lift import build_locators, lift
from flyreg_core.orientation import orientations
from flyreg_core.progress import ignore
from flyreg_core.rectangle import from_plane, wrapped
from flyreg_core.surface_distance import distances_to_surface, measure_distances
from flyreg_core.topology import compacted
from flyreg_core.unfold import count_flipped
from tests.brains import PreparedBrain, fit_splines, register_pair

SEEDS = st.integers(0, 2**32 - 1)
BY_LENGTH = LandmarkParameters(pairing="arc length")


@pytest.fixture(scope="module")
def source(demo_source) -> PreparedBrain:
    return demo_source


@pytest.fixture(scope="module")
def target(demo_target) -> PreparedBrain:
    return demo_target


@pytest.fixture(scope="module")
def locators(demo_target):
    return build_locators(demo_target.flat)


def true_pairs(source, count, weight=1.0):
    """Interior landmarks whose targets are where the demo pair is known to correspond."""
    dissection = source.flat.dissection
    faces = np.concatenate([dissection.faces_of(half) for half in HALVES])
    choices = np.random.default_rng(count).choice(np.unique(faces), count, replace=False)
    places = dissection.surface.vertices[choices]
    return tuple(
        LandmarkPair(
            f"true-{k}",
            f"true {k}",
            "interior",
            None,
            tuple(map(float, a)),
            tuple(map(float, b)),
            weight,
        )
        for k, (a, b) in enumerate(zip(places, deform(places), strict=True))
    )


def acting(source, target, pairs):
    """The ids of the pairs whose ends lie on the same half."""
    marks = place_landmarks(source.flat, target.flat, pairs)
    found = {mark.pair.id for mark in marks if mark.plane}
    assert len(found) >= 5
    return found


def error_of(registration, source):
    """How far vertices come to lie from where they belong, on average."""
    away = registration.surface.vertices - deform(source.surface.vertices)
    return np.linalg.norm(away, axis=1).mean()


@pytest.mark.parametrize("half", HALVES)
def test_lifting_what_was_laid_flat_gives_it_back(target, locators, half):
    flat = target.flat.halves[half]
    lifted = lift(flat.flat.uv, flat, locators.halves[half], target.surface.vertices)
    away = lifted - target.surface.vertices[flat.vertex_of]
    assert np.abs(away).max() < 1e-9 * target.surface.diagonal


@pytest.mark.parametrize("half", HALVES)
@given(seed=SEEDS)
@settings(max_examples=10)
def test_a_place_within_a_flat_face_is_lifted_to_the_same_place_within_the_face(
    target, locators, half, seed
):
    rng = np.random.default_rng(seed)
    flat, points = target.flat.halves[half], target.surface.vertices
    faces, weights = rng.integers(0, len(flat.faces), 100), rng.dirichlet(np.ones(3), 100)
    uv = np.einsum("ij,ijk->ik", weights, flat.flat.corners[faces])
    uv[:, 0] += rng.integers(-3, 4, 100)
    expected = np.einsum("ij,ijk->ik", weights, points[flat.vertex_of[flat.faces[faces]]])
    lifted = lift(uv, flat, locators.halves[half], points)
    assert np.abs(lifted - expected).max() < 1e-6 * target.surface.diagonal


@pytest.mark.parametrize("pairing", ["coordinate", "arc length", "nearest"])
@pytest.mark.parametrize("smoothing", [1e-6, 1e-3, 1.0])
def test_a_brain_registered_to_itself_stays_where_it_is(source, pairing, smoothing):
    registration = register_pair(source, source, LandmarkParameters(pairing=pairing), smoothing)
    away = registration.surface.vertices - source.surface.vertices
    assert np.abs(away).max() < 1e-9 * source.surface.diagonal
    assert max(registration.residual_um.values()) < 1e-9 * source.surface.diagonal


def test_the_registered_surface_is_watertight_with_one_handle(demo_registration, source):
    surface = demo_registration.surface
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.euler_number == 0
    assert np.array_equal(surface.faces, source.surface.faces)


def test_every_registered_vertex_lies_on_the_target(demo_registration, target):
    for goal in (target.surface, target.torus.surface):
        away = distances_to_surface(demo_registration.surface.vertices, goal, ignore)
        assert away.max() < 1e-9 * target.surface.diagonal


def test_no_flat_face_is_flipped_in_the_end(demo_registration):
    assert demo_registration.flipped_on_caps == 0
    for half in demo_registration.halves.values():
        assert half.flipped == 0
        assert (orientations(half.flat.corners) == 1).all()


def test_the_registered_surface_is_close_to_the_target_both_ways(demo_registration, target):
    distances = measure_distances(demo_registration.surface, target.torus.surface, ignore, 20_000)
    for summary in (distances.a_to_b, distances.b_to_a):
        assert summary.mean_um < 1e-3 * distances.diagonal_um
        assert summary.hausdorff_um < 0.03 * distances.diagonal_um


@pytest.mark.parametrize("number", range(7))
def test_each_boundary_curve_comes_to_lie_on_its_curve(demo_registration, source, target, number):
    key = list(source.flat.curves)[number]
    points = demo_registration.surface.vertices[source.flat.curves[key].vertices]
    line = target.flat.curves[key].points
    a, b = line[:-1], line[1:]
    along = ((points[:, None] - a) * (b - a)).sum(-1) / ((b - a) ** 2).sum(-1)
    feet = a + np.clip(along, 0, 1)[..., None] * (b - a)
    away = np.linalg.norm(points[:, None] - feet, axis=2).min(axis=1)
    assert away.max() < 1e-9 * target.surface.diagonal


def test_corners_come_to_lie_on_corners(demo_registration, source, target):
    for curve in ("upper", "lower"):
        ends = source.flat.curves[curve, None].vertices[[0, -1]]
        goals = target.flat.curves[curve, None].points[[0, -1]]
        assert demo_registration.surface.vertices[ends] == pytest.approx(goals)


@pytest.mark.parametrize("half", HALVES)
def test_each_half_comes_to_lie_on_the_same_half(demo_registration, source, target, half):
    faces, used = compacted(target.flat.dissection.faces_of(half))
    goal = type(target.surface)(target.surface.vertices[used], faces)
    moved = demo_registration.surface.vertices[source.flat.halves[half].vertex_of]
    assert distances_to_surface(moved, goal, ignore).max() < 1e-9 * target.surface.diagonal


@pytest.mark.parametrize("half", HALVES)
def test_boundaries_stay_boundaries_on_the_strip(demo_registration, source, half):
    uv, flat = demo_registration.halves[half].flat.uv, source.flat.halves[half]
    assert (uv[flat.outer, 1] == 1).all()
    assert (uv[flat.hole, 1] == 0).all()
    inner = np.setdiff1d(np.arange(len(uv)), np.concatenate([flat.outer, flat.hole]))
    assert uv[inner, 1].min() > 0
    assert uv[inner, 1].max() < 1


@pytest.mark.parametrize("half", HALVES)
def test_what_sewing_changes_at_a_boundary_fades_out_towards_the_other(source, target, half):
    smoothing = 1.0  # so much that the spline misses the boundaries
    by_axes = LandmarkParameters(pairing="coordinate")
    pairs = boundary_pairs(source.flat, target.flat, by_axes)
    spline = fit_splines(place_landmarks(source.flat, target.flat, pairs), smoothing)[half]
    flat = source.flat.halves[half]
    u, beta = from_plane(spline(flat.plane))
    warped = register_pair(source, target, by_axes, smoothing).halves[half]
    change = np.stack(
        [
            wrapped(warped.flat.uv[:, 0] - u),
            target.flat.halves[half].law.beta(warped.flat.uv[:, 1]) - beta,
        ],
        axis=1,
    )
    at = np.mod(flat.flat.uv[:, 0], 1)
    expected = np.zeros_like(change)
    for loop, share in ((flat.outer, flat.beta), (flat.hole, 1 - flat.beta)):
        for axis in (0, 1):
            expected[:, axis] += share * np.interp(at, at[loop], change[loop, axis], period=1)
    kept = ~warped.is_mended
    assert np.abs(change).max() > 1e-3
    assert kept.mean() > 0.5
    assert np.quantile(np.abs(change - expected)[kept], 0.999) < 1e-9


def test_residuals_are_those_of_the_delivered_surface(source, target):
    pairs = true_pairs(source, 10)
    registration = register_pair(source, target, BY_LENGTH, 1e-2, pairs)
    marks = place_landmarks(source.flat, target.flat, pairs)
    ids = {mark.pair.id for mark in marks if mark.plane}
    assert ids
    assert ids < set(registration.residual_um)
    for mark in marks:
        if mark.plane:  # true pairs start at vertices
            away = np.linalg.norm(source.surface.vertices - mark.source_point, axis=1)
            end = registration.surface.vertices[away.argmin()]
            told = registration.residual_um[mark.pair.id]
            assert told == pytest.approx(np.linalg.norm(end - mark.target_point), abs=1e-6)


def test_much_smoothing_leaves_larger_residuals(source, target):
    pairs = true_pairs(source, 10)
    means = [
        np.mean([*register_pair(source, target, BY_LENGTH, smoothing, pairs).residual_um.values()])
        for smoothing in (1e-3, 0.1, 10.0)
    ]
    assert means[0] < means[1] < means[2]


def test_landmarks_that_are_right_bring_the_brain_closer_to_the_truth(source, target):
    error = [
        error_of(register_pair(source, target, BY_LENGTH, 1e-3, true_pairs(source, count)), source)
        for count in (0, 20, 80)
    ]
    assert error[2] < error[1] < error[0]
    assert error[2] < 0.7 * error[0]


def test_landmarks_of_weight_zero_change_nothing_but_are_measured(source, target):
    pairs = true_pairs(source, 10, weight=0.0)
    one = register_pair(source, target, BY_LENGTH, 1e-3)
    other = register_pair(source, target, BY_LENGTH, 1e-3, pairs)
    away = np.abs(one.surface.vertices - other.surface.vertices)
    assert away.max() < 1e-6 * target.surface.diagonal
    assert acting(source, target, pairs) < set(other.residual_um)


def test_folds_of_the_spline_are_counted_and_mended(source, target):
    pairs = true_pairs(source, 10)
    crossed = tuple(
        LandmarkPair(f"x{k}", f"x{k}", "interior", None, a.source, b.target)
        for k, (a, b) in enumerate(zip(pairs, pairs[::-1], strict=True))
    )
    registration = register_pair(source, target, BY_LENGTH, 1e-6, crossed)
    assert sum(half.folds_mended for half in registration.halves.values()) > 10
    for half in registration.halves.values():
        assert count_flipped(half.flat) == 0
        assert half.is_mended.any() == (half.folds_mended > 0)
    away = distances_to_surface(registration.surface.vertices, target.surface, ignore)
    assert away.max() < 1e-9 * target.surface.diagonal


def test_halves_that_agree_on_their_boundary_need_no_sewing(source, target):
    registration = register_pair(source, target, BY_LENGTH)
    for half in registration.halves.values():
        assert half.gap_um < 1e-6 * target.surface.diagonal


def test_the_same_call_gives_the_same_bytes(demo_registration, source, target):
    again = register_pair(source, target, LandmarkParameters())
    assert np.array_equal(again.surface.vertices, demo_registration.surface.vertices)
    assert again.residual_um == demo_registration.residual_um
