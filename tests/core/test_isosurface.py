import itertools

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from flyreg_core.isosurface import extract_surface
from flyreg_core.solid import kuhn_structure
from flyreg_core.topology import component_of_vertex, euler_characteristic, is_closed, unique_edges

SEEDS = st.integers(0, 2**32 - 1)
ORIGIN = np.zeros(3)


def random_field(seed, share=0.5, shape=(6, 5, 4)):
    """Values of any size whose sign is positive at a share of the places, never at the outermost."""
    rng = np.random.default_rng(seed)
    field = -(10.0 ** rng.uniform(-12, 3, np.add(shape, 2)))
    core = field[1:-1, 1:-1, 1:-1]
    core[rng.uniform(size=shape) < share] *= -1
    core.flat[rng.integers(core.size)] = 1.0
    return field


def euler_characteristic_of_voxels(inside):
    """Of the complex whose simplices are the sets of inside voxels that are neighbours in pairs."""
    steps = [np.array(s) for s in itertools.product((0, 1), repeat=3)]
    total = 0
    for start in np.argwhere(inside):
        for size in range(4):  # chains start < start + a < start + b < ... of growing steps
            for chain in itertools.combinations(steps[1:], size):
                ordered = sorted(chain, key=lambda s: int(s.sum()))
                grows = all((a <= b).all() for a, b in itertools.pairwise(ordered))
                if grows and all(inside[tuple(start + s)] for s in ordered):
                    total += (-1) ** size
    return total


def ball(n, radius=1.0):
    """Depth in a ball on a grid of n steps across."""
    pitch = 3.0 / n
    grid = -1.5 + pitch * np.stack(np.indices((n + 1,) * 3), axis=-1)
    return extract_surface(radius - np.linalg.norm(grid, axis=-1), np.full(3, -1.5), pitch)


@given(seed=SEEDS, share=st.floats(0, 1))
def test_the_surface_of_any_field_is_closed_and_manifold(seed, share):
    surface = extract_surface(random_field(seed, share), ORIGIN, 1.0)
    assert is_closed(surface.faces)
    other = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert other.is_watertight
    assert other.is_winding_consistent
    for vertex in range(len(surface.vertices)):  # the faces around each vertex form one ring
        around = surface.faces[(surface.faces == vertex).any(axis=1)]
        link = [[v for v in face if v != vertex] for face in around.tolist()]
        assert len(reached_from_first(link)) == len(link)


def reached_from_first(link):
    """The links reached from the first by shared ends."""
    reached, ends = {0}, set(link[0])
    while grown := {k for k, pair in enumerate(link) if k not in reached and ends & set(pair)}:
        reached |= grown
        ends |= {end for k in grown for end in link[k]}
    return reached


@given(seed=SEEDS, share=st.floats(0, 1))
def test_the_surface_has_twice_the_euler_characteristic_of_the_voxels_it_surrounds(seed, share):
    field = random_field(seed, share)
    surface = extract_surface(field, ORIGIN, 1.0)
    assert euler_characteristic(surface.faces) == 2 * euler_characteristic_of_voxels(field > 0)


@given(seed=SEEDS, share=st.floats(0, 1))
def test_each_piece_of_the_inside_and_each_cavity_has_one_piece_of_surface(seed, share):
    field = random_field(seed, share)
    surface = extract_surface(field, ORIGIN, 1.0)
    pieces = ndimage.label(field > 0, kuhn_structure())[1]
    outside = ndimage.label(field <= 0, kuhn_structure())[1]
    assert len(set(component_of_vertex(surface.faces).tolist())) == pieces + outside - 1


@given(seed=SEEDS, share=st.floats(0, 1))
def test_no_face_loses_its_area_however_small_the_values(seed, share):
    surface = extract_surface(random_field(seed, share), ORIGIN, 1.0)
    assert surface.face_areas.min() > 1e-4


def grid_ends(surface, field):
    """The inside and the outside voxel between which each vertex lies."""
    places = surface.vertices.round(9)
    low, high = np.floor(places).astype(int), np.ceil(places).astype(int)
    is_low_inside = (field[tuple(low.T)] > 0)[:, None]
    return np.where(is_low_inside, low, high), np.where(is_low_inside, high, low)


@given(seed=SEEDS)
def test_vertices_lie_on_grid_edges_from_inside_to_outside_voxels(seed):
    field = random_field(seed)
    surface = extract_surface(field, ORIGIN, 1.0)
    inside, outside = grid_ends(surface, field)
    assert (field[tuple(inside.T)] > 0).all()
    assert (field[tuple(outside.T)] <= 0).all()
    away = np.linalg.norm(np.cross(surface.vertices - inside, outside - inside), axis=1)
    assert away == pytest.approx(0, abs=1e-9)


@given(seed=SEEDS)
def test_every_face_looks_from_the_inside_voxels_to_the_outside_ones(seed):
    field = np.sign(random_field(seed)) * np.random.default_rng(seed).uniform(1, 2, (8, 7, 6))
    surface = extract_surface(field, ORIGIN, 1.0)
    inside, outside = grid_ends(surface, field)
    out = (outside - inside)[surface.faces]
    assert (np.einsum("fi,fci->fc", surface.face_normals, out) > 0).all()


def test_a_plane_through_the_grid_is_drawn_exactly():
    grid = np.stack(np.indices((8, 8, 8)), axis=-1).astype(float)
    field = 3.4 - grid[..., 2]
    field[[0, -1]] = field[:, [0, -1]] = field[:, :, [0, -1]] = -1.0
    surface = extract_surface(field, np.array([5.0, 6.0, 7.0]), 2.0)
    top = surface.vertices[surface.vertices[:, 2] > 12]
    inner = (np.abs(top[:, :2] - [12, 13]) < 4).all(axis=1)
    assert inner.sum() > 10
    assert top[inner, 2] == pytest.approx(7.0 + 2.0 * 3.4)


def test_the_volume_of_a_ball_converges_with_the_square_of_the_pitch():
    error = [abs(ball(n).volume - 4 / 3 * np.pi) for n in (12, 24, 48)]
    assert error[1] < error[0] / 3
    assert error[2] < error[1] / 3
    assert error[2] < 0.01 * 4 / 3 * np.pi


def test_a_ball_has_no_handle():
    surface = ball(20)
    assert euler_characteristic(surface.faces) == 2
    assert np.linalg.norm(surface.vertices, axis=1) == pytest.approx(1, abs=0.02)


def test_a_single_voxel_is_surrounded_by_its_fourteen_neighbours():
    field = np.full((3, 3, 3), -1.0)
    field[1, 1, 1] = 1.0
    surface = extract_surface(field, ORIGIN, 1.0)
    assert len(surface.vertices) == 14
    assert len(unique_edges(surface.faces)[0]) == 36


def test_the_same_field_gives_the_same_bytes():
    field = random_field(7)
    one, other = (extract_surface(field.copy(), ORIGIN, 1.0) for _ in range(2))
    assert np.array_equal(one.vertices, other.vertices)
    assert np.array_equal(one.faces, other.faces)
