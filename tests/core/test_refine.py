import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flyreg_core.mesh import SurfaceMesh
from flyreg_core.refine import chords, keep_largest_regions, split_along_zero, split_edges
from flyreg_core.topology import euler_characteristic, half_edges, is_closed, unique_edges
from tests.shapes import annulus, sphere, torus

SEEDS = st.integers(0, 2**32 - 1)
SHAPES = {"sphere": sphere(rounds=2), "torus": torus(around=10, across=8)}
NAMES = st.sampled_from(sorted(SHAPES))


def random_values(seed, count):
    """Some exactly 0, some tiny, some large."""
    rng = np.random.default_rng(seed)
    values = rng.normal(size=count) * 10.0 ** rng.uniform(-9, 3, count)
    values[rng.uniform(size=count) < 0.05] = 0.0
    return values


def split(name, seed):
    vertices, faces = SHAPES[name]
    values = random_values(seed, len(vertices))
    return vertices, faces, values, split_along_zero(faces, values)


def random_edges(seed, faces):
    """Some edges, never all three of one face."""
    edges, _ = unique_edges(faces)
    order = np.random.default_rng(seed).permutation(len(edges))
    chosen = set()
    sides = [{tuple(sorted(p)) for p in ((a, b), (b, c), (c, a))} for a, b, c in faces.tolist()]
    for edge in edges[order[: len(order) // 2]].tolist():
        if not any(tuple(edge) in face and face <= chosen | {tuple(edge)} for face in sides):
            chosen.add(tuple(edge))
    return np.array(sorted(chosen))


@given(name=NAMES, seed=SEEDS)
def test_splitting_leaves_the_surface_where_it_is(name, seed):
    vertices, faces, _, refinement = split(name, seed)
    before = SurfaceMesh(vertices, faces)
    after = SurfaceMesh(refinement.carry(vertices), refinement.faces)
    assert np.array_equal(after.vertices[: len(vertices)], vertices)
    parts = np.bincount(refinement.parent, after.face_areas)
    assert parts == pytest.approx(before.face_areas)  # so nothing overlaps or is left out
    assert after.face_areas.min() > 0
    normals = after.face_normals / after.face_areas[:, None]
    assert normals == pytest.approx(
        (before.face_normals / before.face_areas[:, None])[refinement.parent]
    )


@given(name=NAMES, seed=SEEDS)
def test_splitting_keeps_the_topology(name, seed):
    _, faces, _, refinement = split(name, seed)
    assert is_closed(refinement.faces)
    assert euler_characteristic(refinement.faces) == euler_characteristic(faces)


@given(name=NAMES, seed=SEEDS)
def test_no_edge_joins_old_vertices_of_different_sign(name, seed):
    vertices, _, values, refinement = split(name, seed)
    edges, _ = unique_edges(refinement.faces)
    old = edges[(edges < len(vertices)).all(axis=1)]
    assert ((values[old[:, 0]] >= 0) == (values[old[:, 1]] >= 0)).all()


@given(name=NAMES, seed=SEEDS)
def test_the_side_of_a_face_is_that_of_every_old_vertex_it_has(name, seed):
    vertices, _, values, refinement = split(name, seed)
    side = refinement.sides(values)
    for corner in range(3):
        old = refinement.faces[:, corner] < len(vertices)
        assert np.array_equal(side[old], values[refinement.faces[old, corner]] >= 0)
    assert (refinement.faces < len(vertices)).any(axis=1).all()


@given(name=NAMES, seed=SEEDS)
def test_the_line_between_the_sides_consists_of_simple_closed_curves_of_new_vertices(name, seed):
    vertices, _, values, refinement = split(name, seed)
    beyond = refinement.faces[~refinement.sides(values)]
    edges, counts = unique_edges(beyond)
    line = edges[counts == 1]
    assert (line >= len(vertices)).all()
    assert set(np.bincount(line.reshape(-1))) <= {0, 2}


@given(name=NAMES, seed=SEEDS)
def test_values_are_zero_on_the_line_unless_it_would_run_into_a_vertex(name, seed):
    vertices, faces = SHAPES[name]
    values = np.random.default_rng(seed).choice([-1.0, 1.0], len(vertices))
    values *= np.random.default_rng(seed).uniform(1, 5, len(vertices))
    refinement = split_along_zero(faces, values)
    assert refinement.carry(values)[len(values) :] == pytest.approx(0, abs=1e-12)


@given(name=NAMES, seed=SEEDS)
def test_affine_values_are_carried_exactly(name, seed):
    vertices, _, _, refinement = split(name, seed)
    slope = np.array([0.3, -2.0, 0.7])
    carried = refinement.carry(vertices @ slope + 5)
    assert carried == pytest.approx(refinement.carry(vertices) @ slope + 5)


def test_a_value_of_zero_counts_as_positive():
    faces = np.array([[0, 1, 2]])
    assert len(split_along_zero(faces, np.array([0.0, 1.0, 2.0])).faces) == 1
    refinement = split_along_zero(faces, np.array([0.0, -1.0, -2.0]))
    assert len(refinement.faces) == 3
    assert refinement.sides(np.array([0.0, -1.0, -2.0])).tolist().count(True) == 1


def test_values_of_one_sign_split_nothing():
    _, faces = SHAPES["torus"]
    refinement = split_along_zero(faces, np.ones(80))
    assert np.array_equal(refinement.faces, faces)
    assert len(refinement.added.ends) == 0


@given(name=NAMES, seed=SEEDS)
def test_edges_are_split_in_the_middle_and_faces_keep_their_orientation(name, seed):
    vertices, faces = SHAPES[name]
    edges = random_edges(seed, faces)
    refinement = split_edges(faces, edges)
    new = refinement.carry(vertices)[len(vertices) :]
    assert new == pytest.approx(vertices[refinement.added.ends].mean(axis=1))
    assert sorted(map(tuple, refinement.added.ends.tolist())) == sorted(map(tuple, edges.tolist()))
    after = SurfaceMesh(refinement.carry(vertices), refinement.faces)
    before = SurfaceMesh(vertices, faces)
    assert np.bincount(refinement.parent, after.face_areas) == pytest.approx(before.face_areas)
    assert is_closed(refinement.faces)
    assert (
        np.einsum("ij,ij->i", after.face_normals, before.face_normals[refinement.parent]) > 0
    ).all()


def test_chords_join_two_boundary_vertices_through_the_inside():
    faces = annulus(around=6, layers=1)[1]  # every edge across it is one
    found = chords(faces, np.ones(12, dtype=bool))
    assert {tuple(edge) for edge in found.tolist()} == {
        tuple(sorted(pair)) for i in range(6) for pair in ((i, i + 6), (i, 6 + (i + 1) % 6))
    }


def test_a_ring_of_two_layers_has_no_chord():
    on_boundary = np.repeat([True, False, True], 6)
    assert len(chords(annulus(around=6, layers=2)[1], on_boundary)) == 0


def regions(faces, chosen):
    graph = nx.Graph()
    graph.add_nodes_from(np.flatnonzero(chosen).tolist())
    directed = half_edges(faces)
    graph.add_edges_from(directed[chosen[directed].all(axis=1)].tolist())
    return list(nx.connected_components(graph))


@given(name=NAMES, seed=SEEDS)
def test_each_sign_keeps_one_region_at_most(name, seed):
    _, faces = SHAPES[name]
    values = random_values(seed, int(faces.max()) + 1)
    kept = keep_largest_regions(faces, values)
    assert len(regions(faces, kept < 0)) <= 1
    assert len(regions(faces, kept >= 0)) <= 1


@given(name=NAMES, seed=SEEDS)
def test_the_largest_negative_region_stays_negative(name, seed):
    _, faces = SHAPES[name]
    values = random_values(seed, int(faces.max()) + 1)
    kept = keep_largest_regions(faces, values)
    before = regions(faces, values < 0)
    largest = max(len(region) for region in before)
    assert any(len(region) == largest and (kept[list(region)] < 0).all() for region in before)


@given(name=NAMES, seed=SEEDS)
def test_values_change_in_sign_only(name, seed):
    _, faces = SHAPES[name]
    values = random_values(seed, int(faces.max()) + 1)
    before = values.copy()
    kept = keep_largest_regions(faces, values)
    assert np.abs(kept) == pytest.approx(np.abs(values), abs=1e-8)
    assert np.array_equal(values, before)


def test_values_that_have_no_islands_stay():
    vertices, faces = SHAPES["sphere"]
    assert np.array_equal(keep_largest_regions(faces, vertices[:, 2] - 5), vertices[:, 2] - 5)
    assert np.array_equal(
        keep_largest_regions(faces, np.abs(vertices[:, 2])), np.abs(vertices[:, 2])
    )
