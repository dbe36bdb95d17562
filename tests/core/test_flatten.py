import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core.errors import Cancelled, MeshError
from flyreg_core.flatten import FlattenParameters, Ring, Springs, edge_jumps, flatten, solve_means
from flyreg_core.mesh import FlatMesh, SurfaceMesh
from flyreg_core.orientation import orientations, signed_areas
from flyreg_core.progress import ignore
from flyreg_core.rectangle import wrapped
from flyreg_core.refine import chords, split_edges
from flyreg_core.topology import half_edges
from tests.shapes import annulus, random_annulus

SEEDS = st.integers(0, 2**32 - 1)
UNIFORM = FlattenParameters(rounds=0)


def growing_shares(rng, count, uneven):
    """Shares of one turn, growing, by random steps of less than half a turn."""
    step = rng.uniform(0.05, 1, count) ** (3 * uneven)
    step /= step.sum()
    while step.max() > 0.49:
        step = (step + 1 / count) / 2
    return rng.uniform(-2, 2) + np.concatenate([[0], np.cumsum(step)[:-1]])


def random_ring(seed, uneven=1.0):
    """A ring without chords whose boundaries are to be spread by random shares."""
    rng = np.random.default_rng(seed)
    outer, hole, inner = (int(rng.integers(*limits)) for limits in ((8, 30), (4, 15), (20, 150)))
    vertices, faces = random_annulus(rng, outer, hole, inner)
    on_boundary = np.zeros(len(vertices), dtype=bool)
    on_boundary[: outer + hole] = True
    found = chords(faces, on_boundary)
    while len(found):
        refinement = split_edges(faces, found[:1])  # one by one, so never a whole face
        vertices, faces = refinement.carry(vertices), refinement.faces
        on_boundary = np.append(on_boundary, False)
        found = chords(faces, on_boundary)
    # seen from +z the hole is at v = 0 and u grows clockwise, or the picture would be mirrored
    outer_loop, hole_loop = np.arange(outer)[::-1], np.arange(outer, outer + hole)[::-1]
    ring = Ring(
        faces,
        outer_loop,
        growing_shares(rng, outer, uneven),
        hole_loop,
        growing_shares(rng, hole, uneven),
    )
    return ring, SurfaceMesh(vertices, faces)


def regular_ring(around=12, layers=4):
    """A ring whose vertices have their place on the strip by symmetry, and that place."""
    vertices, faces = annulus(around, layers)
    layer, place = np.divmod(np.arange(len(vertices)), around)
    expected = np.stack([-place / around, layer / layers], axis=1)
    loops = [np.arange(around)[::-1] + start for start in (layers * around, 0)]
    ring = Ring(faces, loops[0], expected[loops[0], 0], loops[1], expected[loops[1], 0])
    return ring, SurfaceMesh(vertices, faces), expected


def laid(seed, parameters, uneven=1.0):
    ring, surface = random_ring(seed, uneven)
    return ring, *flatten(ring, surface.face_areas, parameters, ignore)


def pulls(flat, springs):
    """The sum of weighted steps to all neighbours, for each vertex, taken from the flat faces."""
    n = int(flat.faces.max()) + 1
    weight = np.zeros((n, n))
    i, j = springs.edges.T
    weight[i, j] = weight[j, i] = springs.weights
    total = np.zeros((n, 2))
    for start, end in ((0, 1), (1, 2), (2, 0)):
        a, b = flat.faces[:, start], flat.faces[:, end]
        step = flat.corners[:, end] - flat.corners[:, start]
        np.add.at(total, a, weight[a, b][:, None] * step)
    return total


def inner_vertices(ring):
    return np.setdiff1d(np.arange(ring.n_vertices), np.concatenate([ring.outer, ring.hole]))


@given(seed=SEEDS, rounds=st.integers(0, 4))
def test_no_face_of_any_ring_is_flipped_or_loses_its_area(seed, rounds):
    _, flat, _ = laid(seed, FlattenParameters(rounds=rounds))
    assert (orientations(flat.corners) == 1).all()


@given(seed=SEEDS)
def test_no_face_is_flipped_whatever_the_positive_weights(seed):
    ring, flat, springs = laid(seed, UNIFORM)
    weights = 10 ** np.random.default_rng(seed).uniform(-2, 2, len(springs.edges))
    is_fixed = np.ones(ring.n_vertices, dtype=bool)
    is_fixed[inner_vertices(ring)] = False
    pulled = Springs(springs.edges, springs.jumps, weights)
    u, v = solve_means(pulled, is_fixed, *flat.uv.T)
    again = FlatMesh(np.stack([u, v], axis=1), flat.faces, flat.corner_shifts)
    assert (orientations(again.corners) == 1).all()


@given(seed=SEEDS, rounds=st.integers(0, 3))
def test_each_inner_vertex_is_the_weighted_mean_of_its_neighbours(seed, rounds):
    ring, flat, springs = laid(seed, FlattenParameters(rounds=rounds))
    inner = inner_vertices(ring)
    total = np.bincount(springs.edges.ravel(), np.repeat(springs.weights, 2))
    away = pulls(flat, springs)[inner] / total[inner, None]
    assert np.abs(away).max() <= 1e-10


@given(seed=SEEDS)
def test_v_agrees_with_a_dense_solution(seed):
    ring, flat, springs = laid(seed, UNIFORM)
    n, inner = ring.n_vertices, inner_vertices(ring)
    laplacian = np.zeros((n, n))
    for a, b in springs.edges.tolist():
        laplacian[a, b] = laplacian[b, a] = -1
    laplacian -= np.diag(laplacian.sum(axis=1))
    known = np.zeros(n)
    known[ring.outer] = 1
    v = np.linalg.solve(laplacian[np.ix_(inner, inner)], -(laplacian @ known)[inner])
    assert flat.uv[inner, 1] == pytest.approx(v, abs=1e-11)


@given(seed=SEEDS)
def test_the_boundaries_lie_where_they_were_put(seed):
    ring, flat, _ = laid(seed, FlattenParameters())
    assert (flat.uv[ring.hole, 1] == 0).all()
    assert (flat.uv[ring.outer, 1] == 1).all()
    assert wrapped(flat.uv[ring.outer, 0] - ring.outer_u) == pytest.approx(0, abs=1e-12)
    assert wrapped(flat.uv[ring.hole, 0] - ring.hole_u) == pytest.approx(0, abs=1e-12)


@given(seed=SEEDS)
def test_the_faces_cover_the_strip_exactly_once(seed):
    _, flat, _ = laid(seed, FlattenParameters())
    assert signed_areas(flat.corners).sum() == pytest.approx(1)


def test_a_regular_ring_becomes_a_regular_strip():
    ring, surface, expected = regular_ring()
    flat, _ = flatten(ring, surface.face_areas, UNIFORM, ignore)
    assert wrapped(flat.uv[:, 0] - expected[:, 0]) == pytest.approx(0, abs=1e-12)
    assert flat.uv[:, 1] == pytest.approx(expected[:, 1])


@given(seed=SEEDS)
@settings(max_examples=15)
def test_averaging_approaches_the_solution(seed):
    ring, surface = random_ring(seed)
    solved, _ = flatten(ring, surface.face_areas, UNIFORM, ignore)
    away = []
    for passes in (20, 200, 2000):
        flat, _ = flatten(ring, surface.face_areas, FlattenParameters(passes=passes), ignore)
        step = flat.uv - solved.uv
        away.append(np.abs([wrapped(step[:, 0]), step[:, 1]]).max())
    assert away[2] <= away[1] <= away[0]
    assert away[2] < 1e-6


def test_without_a_pass_every_vertex_lies_on_a_boundary():
    ring, surface = random_ring(3)
    flat, _ = flatten(ring, surface.face_areas, FlattenParameters(passes=0), ignore)
    assert set(flat.uv[:, 1]) == {0.0, 1.0}


@given(seed=SEEDS, turns=st.integers(-3, 3))
def test_whole_turns_of_a_boundary_change_nothing(seed, turns):
    ring, surface = random_ring(seed)
    turned = Ring(ring.faces, ring.outer, ring.outer_u, ring.hole, ring.hole_u + turns)
    flat, _ = flatten(ring, surface.face_areas, UNIFORM, ignore)
    again, _ = flatten(turned, surface.face_areas, UNIFORM, ignore)
    assert again.uv == pytest.approx(flat.uv, abs=1e-9)


@given(seed=SEEDS)
def test_where_a_loop_starts_changes_nothing(seed):
    ring, surface = random_ring(seed)
    by = int(np.random.default_rng(seed).integers(1, len(ring.outer)))
    outer_u = np.roll(ring.outer_u, -by)
    turned = Ring(ring.faces, np.roll(ring.outer, -by), outer_u, ring.hole, ring.hole_u)
    flat, _ = flatten(ring, surface.face_areas, UNIFORM, ignore)
    again, _ = flatten(turned, surface.face_areas, UNIFORM, ignore)
    assert wrapped(again.uv[:, 0] - flat.uv[:, 0]) == pytest.approx(0, abs=1e-9)
    assert again.uv[:, 1] == pytest.approx(flat.uv[:, 1], abs=1e-12)


@given(seed=SEEDS)
def test_no_whole_turn_of_the_hole_would_be_less_twisted(seed):
    _, flat, springs = laid(seed, UNIFORM)
    i, j = springs.edges.T

    def energy(turns):
        u = flat.uv[:, 0] + turns * (1 - flat.uv[:, 1])
        return springs.weights @ (u[j] + springs.jumps - u[i]) ** 2

    assert energy(0) <= min(energy(-1), energy(1)) + 1e-9


@given(seed=SEEDS)
def test_the_jumps_add_up_to_nothing_around_a_face_and_to_one_turn_around_the_ring(seed):
    ring, _ = random_ring(seed)
    edges, jumps = edge_jumps(ring)
    jump = {tuple(edge): int(k) for edge, k in zip(edges.tolist(), jumps, strict=True)}
    jump |= {(b, a): -k for (a, b), k in jump.items()}
    for a, b, c in ring.faces.tolist():
        assert jump[a, b] + jump[b, c] + jump[c, a] == 0
    for loop in (ring.outer.tolist(), ring.hole.tolist()):
        assert sum(jump[pair] for pair in itertools.pairwise([*loop, loop[0]])) == 1


@given(seed=SEEDS)
@settings(max_examples=20)
def test_rounds_make_areas_more_even(seed):
    ring, surface = random_ring(seed, uneven=0.0)
    spread = []
    for rounds in (0, 2):
        flat, _ = flatten(ring, surface.face_areas, FlattenParameters(rounds=rounds), ignore)
        spread.append(np.log(signed_areas(flat.corners) / surface.face_areas).std())
    assert spread[1] < spread[0]


def test_fixed_vertices_stay_exactly_and_free_ones_among_them_are_means():
    _, flat, springs = laid(5, UNIFORM)
    rng = np.random.default_rng(5)
    is_fixed = rng.uniform(size=len(flat.uv)) < 0.7
    u, v = solve_means(springs, is_fixed, *flat.uv.T)
    assert np.array_equal(u[is_fixed], flat.uv[is_fixed, 0])
    assert np.array_equal(v[is_fixed], flat.uv[is_fixed, 1])
    inner = inner_vertices(random_ring(5)[0])
    free = np.intersect1d(np.flatnonzero(~is_fixed), inner)
    again = FlatMesh(np.stack([u, v], axis=1), flat.faces, flat.corner_shifts)
    assert np.abs(pulls(again, springs)[free]).max() < 1e-10


def test_each_edge_of_the_springs_is_an_edge_of_the_ring():
    ring, _, springs = laid(5, UNIFORM)
    sides = {tuple(sorted(pair)) for pair in half_edges(ring.faces).tolist()}
    assert {tuple(edge) for edge in springs.edges.tolist()} == sides
    assert (springs.weights > 0).all()


def test_fewer_passes_than_none_are_refused():
    ring, surface = random_ring(1)
    with pytest.raises(
        MeshError, match="the number of flattening passes must be at least 0, not -3"
    ):
        flatten(ring, surface.face_areas, FlattenParameters(passes=-3), ignore)


@pytest.mark.parametrize("passes", [None, 1000])
def test_flattening_can_be_cancelled(passes):
    def report(fraction, text):
        if fraction > 0.3:
            raise Cancelled

    ring, surface = random_ring(1)
    with pytest.raises(Cancelled):
        flatten(ring, surface.face_areas, FlattenParameters(passes=passes), report)
