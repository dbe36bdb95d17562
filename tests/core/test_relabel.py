import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from flyreg_core.relabel import find_links, grow_patch, may_change, move_border
from flyreg_core.topology import component_of_vertex, unique_edges
from tests.shapes import box, sphere, tetrahedron, torus

SEEDS = st.integers(0, 2**32 - 1)
SPREADS = st.sampled_from([0, 3, 20])
AROUND, ACROSS = 48, 24
TORUS = torus(around=AROUND, across=ACROSS)
BALL = sphere(rounds=4)


def links_of(shape):
    vertices, faces = shape
    return find_links(faces, len(vertices))


TORUS_LINKS, BALL_LINKS = links_of(TORUS), links_of(BALL)
AROUND_HOLE = np.arctan2(TORUS[0][:, 1], TORUS[0][:, 0]) % (2 * np.pi)

RINGS = np.sin(AROUND_HOLE) > 0.1
HEMISPHERES = BALL[0][:, 2] > 1e-9


def part(faces, chosen):
    """Euler characteristic and number of components of all that lies between chosen vertices."""
    edges, _ = unique_edges(faces)
    inner_edges = edges[chosen[edges].all(axis=1)]
    inner_faces = faces[chosen[faces].all(axis=1)]
    characteristic = int(chosen.sum()) - len(inner_edges) + len(inner_faces)
    component = component_of_vertex(faces, len(chosen), chosen)[chosen]
    return characteristic, len(np.unique(component))


def random_wishes(seed, shape, spread):
    """Noise on the vertices of a shape, the more spread the smoother."""
    vertices, faces = shape
    edges, _ = unique_edges(faces)
    noise = np.random.default_rng(seed).normal(size=len(vertices))
    degree = np.bincount(edges.reshape(-1), minlength=len(vertices))
    for _ in range(spread):
        total = np.bincount(edges[:, 0], noise[edges[:, 1]], len(vertices))
        total += np.bincount(edges[:, 1], noise[edges[:, 0]], len(vertices))
        noise = (noise + total / degree) / 2
    return noise


def arc_of_angle(angle, start, end):
    """Positive from `start` on until `end`, negative elsewhere: how far it is to the nearer end."""
    middle, half = (start + end) / 2, (end - start) / 2
    away = np.abs((angle - middle + np.pi) % (2 * np.pi) - np.pi)
    return half - away


@pytest.mark.parametrize("shape", [TORUS, BALL, box(), tetrahedron()], ids=len)
def test_the_link_of_a_vertex_is_one_closed_chain_through_its_neighbours(shape):
    vertices, faces = shape
    links = links_of(shape)
    edges, _ = unique_edges(faces)
    for vertex in range(len(vertices)):
        own = links.edges[links.start[vertex] : links.start[vertex + 1]]
        neighbours = edges[(edges == vertex).any(axis=1)]
        neighbours = set(neighbours[neighbours != vertex].tolist())
        following = dict(own.tolist())
        chain = [min(neighbours)]
        while (after := following[chain[-1]]) != chain[0]:
            chain.append(after)
        assert set(chain) == neighbours
        assert len(own) == len(chain)


@given(seed=SEEDS, spread=SPREADS)
def test_two_rings_remain_two_rings_whatever_is_wanted(seed, spread):
    moved = move_border(TORUS_LINKS, RINGS, random_wishes(seed, TORUS, spread))
    assert part(TORUS[1], moved) == (0, 1)
    assert part(TORUS[1], ~moved) == (0, 1)


@given(seed=SEEDS, spread=SPREADS)
@settings(max_examples=25)
def test_two_disks_remain_two_disks_whatever_is_wanted(seed, spread):
    moved = move_border(BALL_LINKS, HEMISPHERES, random_wishes(seed, BALL, spread))
    assert part(BALL[1], moved) == (1, 1)
    assert part(BALL[1], ~moved) == (1, 1)


@given(seed=SEEDS, spread=SPREADS, share=st.floats(0.2, 0.8))
@settings(max_examples=25)
def test_sides_of_any_topology_keep_it(seed, spread, share):
    field = random_wishes(seed + 1, TORUS, 10)
    side = field > np.quantile(field, share)
    moved = move_border(TORUS_LINKS, side, random_wishes(seed, TORUS, spread))
    assert part(TORUS[1], moved) == part(TORUS[1], side)
    assert part(TORUS[1], ~moved) == part(TORUS[1], ~side)


@given(seed=SEEDS, spread=SPREADS)
def test_a_vertex_that_changes_side_changes_to_the_one_that_is_wanted(seed, spread):
    wanted = random_wishes(seed, TORUS, spread)
    moved = move_border(TORUS_LINKS, RINGS, wanted)
    has_changed = moved != RINGS
    assert np.array_equal(moved[has_changed], (wanted >= 0)[has_changed])


@given(seed=SEEDS, spread=SPREADS)
def test_no_vertex_that_is_on_the_wrong_side_in_the_end_could_change(seed, spread):
    wanted = random_wishes(seed, TORUS, spread)
    moved = move_border(TORUS_LINKS, RINGS, wanted)
    is_wrong = np.flatnonzero(moved != (wanted >= 0))
    assert not may_change(TORUS_LINKS, moved, is_wrong).any()


@given(seed=SEEDS)
def test_a_vertex_may_change_where_that_changes_no_topology_and_then_only(seed):
    field = random_wishes(seed, TORUS, 3)
    side = field > 0
    for vertex in np.random.default_rng(seed).integers(len(side), size=5):
        changed = side.copy()
        changed[vertex] = not side[vertex]
        keeps = all(
            part(TORUS[1], s) == part(TORUS[1], c) for s, c in ((side, changed), (~side, ~changed))
        )
        if may_change(TORUS_LINKS, side, np.array([vertex]))[0]:
            assert keeps
        else:  # arcs or none: one side gains or loses something
            assert not keeps


@given(start=st.floats(-2.8, 2.8), end=st.floats(0.4, 5.8))
def test_two_arcs_of_angle_are_reached_exactly_if_each_shares_a_ring_with_what_was_there(
    start, end
):
    assume(0.3 < end - start < 6)
    wanted = arc_of_angle(AROUND_HOLE, start, end)
    goal = wanted >= 0
    assume(part(TORUS[1], goal & RINGS) == part(TORUS[1], ~goal & ~RINGS) == (0, 1))
    assert np.array_equal(move_border(TORUS_LINKS, RINGS, wanted), goal)


@given(seed=SEEDS, amount=st.floats(0, 0.6))
def test_a_wavy_border_near_by_is_reached_exactly_where_it_leaves_two_rings(seed, amount):
    waves = random_wishes(seed, TORUS, 60)
    wanted = arc_of_angle(AROUND_HOLE, 0.3, np.pi + 0.2) + amount * waves / np.abs(waves).max()
    goal = wanted >= 0
    moved = move_border(TORUS_LINKS, RINGS, wanted)
    are_rings = part(TORUS[1], goal) == (0, 1) and part(TORUS[1], ~goal) == (0, 1)
    assert np.array_equal(moved, goal) == are_rings


def test_what_has_another_topology_is_not_reached():
    across = np.arctan2(TORUS[0][:, 2], np.hypot(*TORUS[0][:, :2].T) - 200.0)
    for wanted in (np.ones(len(across)), -np.ones(len(across)), np.cos(across)):
        moved = move_border(TORUS_LINKS, RINGS, wanted)
        assert part(TORUS[1], moved) == part(TORUS[1], ~moved) == (0, 1)
        assert not np.array_equal(moved, wanted >= 0)


def test_what_is_wanted_already_stays():
    assert np.array_equal(move_border(TORUS_LINKS, RINGS, np.where(RINGS, 1.0, -1.0)), RINGS)


def test_the_side_that_was_given_is_not_changed():
    before = RINGS.copy()
    move_border(TORUS_LINKS, RINGS, arc_of_angle(AROUND_HOLE, 1.0, 4.0))
    assert np.array_equal(RINGS, before)


def border_of(side):
    edges, _ = unique_edges(TORUS[1])
    ends = np.unique(edges[side[edges[:, 0]] != side[edges[:, 1]]])
    return ends[may_change(TORUS_LINKS, side, ends)]


def grown(seed, spread=20, reach=120.0):
    """Rings with a random border, and a patch on it grown over a random region."""
    rng = np.random.default_rng(seed)
    side = move_border(TORUS_LINKS, RINGS, random_wishes(seed, TORUS, spread))
    start = int(rng.choice(border_of(side)))
    away = np.linalg.norm(TORUS[0] - TORUS[0][start], axis=1)
    waves = random_wishes(seed + 1, TORUS, spread)
    wanted = away < reach * (1 + 0.5 * waves / np.abs(waves).max())
    nothing = np.zeros(len(side), dtype=np.int64)
    return side, wanted, start, grow_patch(TORUS_LINKS, nothing, side, wanted, start, 5)


PATCHES = given(seed=SEEDS, spread=SPREADS, reach=st.floats(0, 400))


@PATCHES
def test_a_patch_is_a_disk_and_leaves_two_rings(seed, spread, reach):
    side, _, _, patch = grown(seed, spread, reach)
    assert part(TORUS[1], patch == 5) == (1, 1)
    assert part(TORUS[1], (patch == 0) & side) == (0, 1)
    assert part(TORUS[1], (patch == 0) & ~side) == (0, 1)


@PATCHES
def test_the_border_crosses_the_rim_of_a_patch_exactly_twice(seed, spread, reach):
    side, _, _, patch = grown(seed, spread, reach)
    label = np.where(patch == 5, 2, side)[TORUS[1]]
    has_all = (np.sort(label, axis=1) == [0, 1, 2]).all(axis=1)
    assert has_all.sum() == 2


@PATCHES
def test_a_patch_covers_nothing_that_is_not_wanted(seed, spread, reach):
    _, wanted, start, patch = grown(seed, spread, reach)
    assert patch[start] == 5
    assert set(np.unique(patch).tolist()) <= {0, 5}
    assert wanted[np.setdiff1d(np.flatnonzero(patch), start)].all()


def test_a_disk_across_the_border_is_covered_whole():
    start = int(np.argmin(np.linalg.norm(TORUS[0] - [-280.0, 0, 0], axis=1)))
    side = RINGS.copy()
    wanted = np.linalg.norm(TORUS[0] - TORUS[0][start], axis=1) < 70
    nothing = np.zeros(len(side), dtype=np.int64)
    patch = grow_patch(TORUS_LINKS, nothing, side, wanted, start, 1)
    assert np.array_equal(patch == 1, wanted)
    assert len(set(side[wanted].tolist())) == 2


@given(seed=SEEDS)
def test_a_second_patch_leaves_the_first_as_it_is(seed):
    side, _, _, first = grown(seed, 20, 80.0)
    starts = [v for v in border_of(side) if first[v] == 0]
    start = int(starts[np.random.default_rng(seed).integers(len(starts))])
    away = np.linalg.norm(TORUS[0] - TORUS[0][start], axis=1)
    both = grow_patch(TORUS_LINKS, first, side, away < 100.0, start, 7)
    assert np.array_equal(both == 5, first == 5)
    assert (both == 7).any()
