import networkx as nx
import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from flyreg_core.errors import TopologyError
from flyreg_core.topology import (
    boundary_loops,
    compacted,
    component_of_vertex,
    count_open_and_non_manifold_edges,
    euler_characteristic,
    genus,
    half_edges,
    is_closed,
    unique_edges,
)
from tests.shapes import annulus, box, inside_out, sphere, tetrahedron, together, torus

SEEDS = st.integers(0, 2**32 - 1)
CLOSED = {"box": (box(), 0), "torus": (torus(), 1), "two": (together(torus(), torus()), 2)}


def some_faces(seed, share):
    """A random part of a torus' faces, at least one."""
    faces = torus(around=8, across=6)[1]
    chosen = np.random.default_rng(seed).uniform(size=len(faces)) < share
    chosen[0] = True
    return faces[chosen]


def sides(faces):
    return [tuple(sorted(pair)) for a, b, c in faces.tolist() for pair in ((a, b), (b, c), (c, a))]


@given(seed=SEEDS, share=st.floats(0, 1))
def test_each_edge_is_listed_once_with_the_number_of_its_faces(seed, share):
    faces = some_faces(seed, share)
    edges, counts = unique_edges(faces)
    expected = sides(faces)
    assert [tuple(edge) for edge in edges.tolist()] == sorted(set(expected))
    assert [expected.count(tuple(edge)) for edge in edges.tolist()] == counts.tolist()


def test_each_face_has_three_half_edges_that_run_around_it():
    directed = half_edges(np.array([[4, 7, 9]]))
    assert sorted(map(tuple, directed.tolist())) == [(4, 7), (7, 9), (9, 4)]


def test_no_faces_have_no_edges():
    edges, counts = unique_edges(np.zeros((0, 3), dtype=np.int64))
    assert edges.shape == (0, 2)
    assert counts.shape == (0,)


def test_open_edges_and_edges_of_three_faces_are_counted():
    fins = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    assert count_open_and_non_manifold_edges(fins) == (6, 1)
    assert count_open_and_non_manifold_edges(box()[1]) == (0, 0)


@pytest.mark.parametrize("name", CLOSED)
def test_a_closed_surface_is_closed_and_has_its_number_of_handles(name):
    (_, faces), handles = CLOSED[name]
    assert is_closed(faces)
    assert genus(faces) == handles


@given(seed=SEEDS, share=st.floats(0.9, 1))
def test_a_surface_is_closed_where_another_library_finds_it_watertight(seed, share):
    faces = some_faces(seed, share)
    other = trimesh.Trimesh(torus(around=8, across=6)[0], faces, process=False)
    assert is_closed(faces) == (other.is_watertight and other.is_winding_consistent)


def test_a_surface_with_one_face_turned_is_not_closed():
    faces = torus()[1].copy()
    faces[5] = faces[5][::-1]
    assert not is_closed(faces)
    assert count_open_and_non_manifold_edges(faces) == (0, 0)


def test_a_surface_that_is_there_twice_is_not_closed():
    faces = np.vstack([tetrahedron()[1]] * 2)
    assert not is_closed(faces)


@given(seed=SEEDS, share=st.floats(0, 1))
def test_the_euler_characteristic_agrees_with_another_library(seed, share):
    faces = some_faces(seed, share)
    other = trimesh.Trimesh(torus(around=8, across=6)[0], faces, process=False)
    assert euler_characteristic(faces) == other.euler_number


def test_vertices_without_faces_do_not_count():
    assert euler_characteristic(box()[1] + 100) == 2
    assert genus(torus()[1] + 100) == 1


def test_an_open_surface_has_no_genus():
    with pytest.raises(
        TopologyError, match="the surface is not closed, so its handles cannot be counted"
    ):
        genus(torus()[1][1:])


@given(seed=SEEDS, share=st.floats(0, 1), chosen_share=st.floats(0, 1))
def test_components_agree_with_another_library(seed, share, chosen_share):
    faces = some_faces(seed, share)
    n = 48
    chosen = np.random.default_rng(seed + 1).uniform(size=n) < chosen_share
    component = component_of_vertex(faces, n, chosen)
    graph = nx.Graph()
    graph.add_nodes_from(range(n))
    graph.add_edges_from(edge for edge in sides(faces) if chosen[list(edge)].all())
    ours = {frozenset(np.flatnonzero(component == c).tolist()) for c in set(component.tolist())}
    assert ours == {frozenset(piece) for piece in nx.connected_components(graph)}


def test_two_surfaces_are_two_components():
    component = component_of_vertex(together(box(), torus())[1])
    assert len(set(component[:8])) == len(set(component[8:])) == 1
    assert component[0] != component[8]


def test_the_surface_lies_to_the_left_of_its_boundary_loops():
    hole, outer = sorted(boundary_loops(annulus(around=12, layers=4)[1]), key=min)
    start = outer.tolist().index(48)
    assert np.roll(outer, -start).tolist() == list(range(48, 60))  # counter-clockwise
    start = hole.tolist().index(11)
    assert np.roll(hole, -start).tolist() == list(range(11, -1, -1))  # clockwise


def test_the_longest_boundary_loop_comes_first():
    shape = together(annulus(around=5), annulus(around=9), box())
    assert [len(loop) for loop in boundary_loops(shape[1])] == [9, 9, 5, 5]


def test_a_closed_surface_has_no_boundary():
    assert boundary_loops(sphere()[1]) == []


@given(seed=SEEDS)
def test_boundary_loops_run_once_along_each_edge_with_one_face(seed):
    faces = sphere(rounds=3)[1]
    away = np.random.default_rng(seed).choice(len(faces), 5, replace=False)
    kept = np.delete(faces, away, axis=0)
    touching = len(np.unique(faces[away])) < 15
    if touching:
        return
    along = [
        tuple(sorted(pair))
        for loop in boundary_loops(kept)
        for pair in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)
    ]
    edges, counts = unique_edges(kept)
    assert sorted(along) == [tuple(edge) for edge in edges[counts == 1].tolist()]


def test_loops_that_touch_in_a_vertex_are_not_told_apart():
    with pytest.raises(
        TopologyError, match="two boundary loops of the surface touch in one vertex"
    ):
        boundary_loops(np.array([[0, 1, 2], [0, 3, 4]]))


@given(seed=SEEDS, share=st.floats(0, 1))
def test_compacted_faces_are_the_same_faces_of_consecutive_vertices(seed, share):
    faces = some_faces(seed, share)
    renumbered, used = compacted(faces)
    assert np.array_equal(used[renumbered], faces)
    assert np.array_equal(np.unique(renumbered), np.arange(len(used)))


def test_turning_a_surface_inside_out_keeps_its_topology():
    faces = inside_out(torus())[1]
    assert is_closed(faces)
    assert genus(faces) == 1
