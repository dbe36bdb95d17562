import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core.caps import (
    CENTER,
    RADIUS,
    cap_grid,
    carry_cap,
    find_caps,
    lay_cap_flat,
    rim_circle,
)
from flyreg_core.landmarks import HALVES
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.orientation import orientations
from flyreg_core.progress import ignore
from flyreg_core.surface_distance import distances_to_surface
from flyreg_core.topology import unique_edges
from tests.brains import PreparedBrain

SEEDS = st.integers(0, 2**32 - 1)
SIDES = ("right", "left")


def caps_of(brain):
    return dict(zip(SIDES, find_caps(brain.flat.dissection, brain.flat.curves), strict=True))


def carried(source, target, side, mapped, near=None):
    """The source's cap carried to the target's: where its vertices go, and how it lies flat."""
    cap, other = caps_of(source)[side], caps_of(target)[side]
    grid = cap_grid(other, lay_cap_flat(other, rim_circle(side, target.flat.curves)))
    corners = target.surface.vertices[other.vertex_of[other.faces]]
    return cap, *carry_cap(cap, mapped, target.flat.curves, grid, corners, near)


def random_shares(brain, seed):
    """For each curve, shares that grow from 0 to 1 by random steps."""
    rng = np.random.default_rng(seed)
    mapped = {}
    for key, curve in brain.flat.curves.items():
        steps = rng.uniform(1e-3, 1, len(curve.share) - 1) ** 3
        mapped[key] = np.concatenate([[0.0], np.cumsum(steps) / steps.sum()])
    return mapped


@pytest.mark.parametrize("side", SIDES)
def test_a_cap_has_the_faces_that_the_cut_gave_it(demo: PreparedBrain, side):
    cap = caps_of(demo)[side]
    assert cap.side == side
    assert np.array_equal(cap.vertex_of[cap.faces], demo.flat.dissection.faces_of(f"{side} cap"))


@pytest.mark.parametrize("side", SIDES)
def test_the_rim_runs_once_around_the_boundary_of_the_cap(demo: PreparedBrain, side):
    cap = caps_of(demo)[side]
    edges, counts = unique_edges(cap.faces)
    boundary = {tuple(edge) for edge in edges[counts == 1].tolist()}
    rim = cap.rim.tolist()
    assert {tuple(sorted(p)) for p in zip(rim, rim[1:] + rim[:1], strict=True)} == boundary
    assert len(set(rim)) == len(rim) == len(boundary)


@pytest.mark.parametrize("side", SIDES)
def test_a_cap_is_laid_flat_on_a_circle_without_a_fold(demo: PreparedBrain, side):
    cap = caps_of(demo)[side]
    circle = rim_circle(side, demo.flat.curves)
    flat = lay_cap_flat(cap, circle)
    assert np.linalg.norm(circle - CENTER, axis=1) == pytest.approx(RADIUS)
    assert np.array_equal(flat[cap.rim], circle)
    assert (orientations(flat[cap.faces]) == 1).all()


@pytest.mark.parametrize("side", SIDES)
def test_inner_vertices_are_the_mean_of_their_neighbours(demo: PreparedBrain, side):
    cap = caps_of(demo)[side]
    flat = lay_cap_flat(cap, rim_circle(side, demo.flat.curves))
    edges, _ = unique_edges(cap.faces)
    for vertex in np.setdiff1d(np.arange(len(flat)), cap.rim)[::37]:
        pairs = edges[(edges == vertex).any(axis=1)]
        around = pairs[pairs != vertex]
        assert flat[vertex] == pytest.approx(flat[around].mean(axis=0), abs=1e-10)


@pytest.mark.parametrize("side", SIDES)
def test_each_half_has_half_of_the_circle(demo: PreparedBrain, side):
    flat = lay_cap_flat(caps_of(demo)[side], rim_circle(side, demo.flat.curves))
    cap = caps_of(demo)[side]
    own = {
        half: np.searchsorted(cap.vertex_of, demo.flat.curves[side, half].vertices)
        for half in HALVES
    }
    for half in HALVES:
        ends = flat[own[half][[0, -1]]]
        assert ends == pytest.approx(CENTER + RADIUS * np.array([[1, 0], [-1, 0]]), abs=1e-12)
    sign = 1 if side == "left" else -1
    assert (sign * flat[own["anterior"][1:-1], 1] > 0).all()
    assert (sign * flat[own["posterior"][1:-1], 1] < 0).all()


@pytest.mark.parametrize("side", SIDES)
def test_a_cap_carried_to_itself_stays_where_it_is(demo: PreparedBrain, side):
    mapped = {key: curve.share for key, curve in demo.flat.curves.items()}
    cap, points, _ = carried(demo, demo, side, mapped)
    away = points - demo.surface.vertices[cap.vertex_of]
    assert np.abs(away).max() < 1e-9 * demo.surface.diagonal


@pytest.mark.parametrize("side", SIDES)
@given(seed=SEEDS)
@settings(max_examples=10)
def test_a_cap_is_carried_without_a_fold_however_its_rim_goes(demo_source, demo_target, side, seed):
    cap, _, on_target = carried(demo_source, demo_target, side, random_shares(demo_source, seed))
    assert (orientations(on_target.flat[cap.faces]) == 1).all()
    assert on_target.flipped == 0


@pytest.mark.parametrize("side", SIDES)
@given(seed=SEEDS)
@settings(max_examples=5)
def test_a_cap_goes_where_it_would_wherever_its_vertices_are_looked_for_first(
    demo_source, demo_target, side, seed
):
    mapped = random_shares(demo_source, seed)
    cap, points, _ = carried(demo_source, demo_target, side, mapped)
    n_faces = len(caps_of(demo_target)[side].faces)
    near = np.random.default_rng(seed).integers(n_faces, size=len(cap.vertex_of))
    _, again, _ = carried(demo_source, demo_target, side, mapped, near)
    assert np.abs(again - points).max() < 1e-6 * demo_target.surface.diagonal


@pytest.mark.parametrize("side", SIDES)
@given(seed=SEEDS)
@settings(max_examples=5)
def test_a_carried_cap_lies_on_the_cap_of_the_target(demo_source, demo_target, side, seed):
    _, points, _ = carried(demo_source, demo_target, side, random_shares(demo_source, seed))
    faces = demo_target.flat.dissection.faces_of(f"{side} cap")
    target = SurfaceMesh(demo_target.surface.vertices, faces)
    away = distances_to_surface(points, target, ignore)
    assert away.max() < 1e-9 * demo_target.surface.diagonal


@pytest.mark.parametrize("side", SIDES)
@given(seed=SEEDS)
@settings(max_examples=5)
def test_the_rim_goes_along_the_rim_to_the_shares_it_is_given(demo_source, demo_target, side, seed):
    mapped = random_shares(demo_source, seed)
    cap, points, _ = carried(demo_source, demo_target, side, mapped)
    for half in HALVES:
        own = np.searchsorted(cap.vertex_of, demo_source.flat.curves[side, half].vertices)
        expected = demo_target.flat.curves[side, half].at(mapped[side, half])
        assert np.abs(points[own] - expected).max() < 1e-6 * demo_target.surface.diagonal
