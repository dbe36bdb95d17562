import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import ndimage

from flyreg_core.carve import NEIGHBOURS, carve, find_membranes, link_of, pieces_of_outside
from flyreg_core.errors import Cancelled
from flyreg_core.isosurface import extract_surface
from flyreg_core.progress import ignore
from flyreg_core.solid import kuhn_structure

SEEDS = st.integers(0, 2**32 - 1)
LINKS = st.integers(0, 2**14 - 1)
STRUCTURE = kuhn_structure()
SIZE = (24, 18, 12)


def block(*tunnels):
    """A block with tunnels along the last axis: (x, y, half of their width less one half)."""
    inside = np.zeros(np.add(SIZE, 6), dtype=bool)
    inside[3:-3, 3:-3, 3:-3] = True
    for x, y, reach in tunnels:
        inside[x - reach : x + reach + 1, y - reach : y + reach + 1] = False
    return inside


def slab(shape):
    """All but the outermost layer."""
    return np.pad(np.ones(np.subtract(shape, 2), dtype=bool), 1)


def random_voxels(seed, shape=(12, 11, 10), share=0.5):
    return np.pad(np.random.default_rng(seed).uniform(size=shape) < share, 1)


def carved(inside, fixed):
    result = inside.copy()
    carve(result, fixed, ndimage.distance_transform_edt(~fixed), ignore)
    return result


def pieces(mask):
    return ndimage.label(mask, STRUCTURE)[1]


def topology(inside):
    """Pieces inside, pieces outside, and the Euler characteristic of the surface between them."""
    surface = extract_surface(np.where(inside, 1.0, -1.0), np.zeros(3), 1.0)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    return pieces(inside), pieces(~inside), mesh.euler_number


def pieces_of_link(inside, voxel):
    """Pieces inside and outside among the neighbours of a voxel, counted by another library."""
    around = inside[tuple(slice(n - 1, n + 2) for n in voxel)]
    link = STRUCTURE.copy()
    link[1, 1, 1] = False
    return pieces(around & link), pieces(~around & link)


@given(seed=SEEDS, share=st.floats(0.3, 0.8), fixed_share=st.floats(0.001, 0.3))
@settings(max_examples=25)
def test_carving_changes_no_topology(seed, share, fixed_share):
    inside = random_voxels(seed, share=share)
    fixed = inside & random_voxels(seed + 1, share=fixed_share)
    assume(fixed.any())
    assert topology(carved(inside, fixed)) == topology(inside)


@given(seed=SEEDS, share=st.floats(0.3, 0.8))
def test_carving_only_takes_away_and_never_what_is_fixed(seed, share):
    inside = random_voxels(seed, share=share)
    fixed = inside & random_voxels(seed + 1, share=0.2)
    result = carved(inside, fixed)
    assert not (result & ~inside).any()
    assert not (fixed & ~result).any()


@given(seed=SEEDS, fixed_share=st.floats(0.01, 0.3))
@settings(max_examples=20)
def test_what_is_left_beside_the_fixed_could_not_go_without_a_change(seed, fixed_share):
    inside = random_voxels(seed, share=0.6)
    fixed = inside & random_voxels(seed + 1, share=fixed_share)
    result = carved(inside, fixed)
    for voxel in np.argwhere(result & ~fixed):
        assert pieces_of_link(result, voxel) != (1, 1)


def test_a_block_is_carved_down_to_the_one_voxel_that_is_fixed():
    fixed = np.zeros((20, 15, 12), dtype=bool)
    fixed[4, 9, 6] = True
    assert np.array_equal(carved(slab(fixed.shape), fixed), fixed)


def test_a_ring_is_carved_down_to_a_closed_chain_of_voxels():
    ring = block((14, 11, 3))
    fixed = np.zeros_like(ring)
    fixed[6, 6, 6] = True
    chain = carved(ring, fixed)
    assert topology(chain)[:2] == (1, 1)
    for voxel in np.argwhere(chain):
        around = chain[tuple(slice(n - 1, n + 2) for n in voxel)]
        assert (around & STRUCTURE).sum() == 3  # itself and two more
    assert chain.sum() < 4 * 18


def test_a_block_around_a_solid_with_tunnels_closes_each_by_a_sheet():
    solid = block((8, 9, 2), (20, 14, 1), (21, 6, 2))
    ball = carved(slab(solid.shape), solid)
    assert topology(ball) == (1, 1, 2)
    assert pieces(ball & ~solid) == 3


@given(seed=SEEDS)
@settings(max_examples=20)
def test_carving_twice_is_carving_once(seed):
    inside = random_voxels(seed, share=0.6)
    fixed = inside & random_voxels(seed + 1, share=0.1)
    once = carved(inside, fixed)
    assert np.array_equal(carved(once, fixed), once)


def test_carving_can_be_cancelled():
    def cancel(fraction, text):
        raise Cancelled

    solid = block((14, 11, 3))
    with pytest.raises(Cancelled):
        carve(slab(solid.shape), solid, ndimage.distance_transform_edt(~solid), cancel)


@given(link=LINKS)
def test_the_pieces_of_a_links_outside_are_those_another_library_finds(link):
    around = np.zeros((3, 3, 3), dtype=bool)
    for k, step in enumerate(NEIGHBOURS):
        around[tuple(step + 1)] = not link >> k & 1
    labels, count = ndimage.label(around, STRUCTURE)
    expected = {
        frozenset(k for k, step in enumerate(NEIGHBOURS) if labels[tuple(step + 1)] == number)
        for number in range(1, count + 1)
    }
    found = pieces_of_outside(link)
    assert {frozenset(piece) for piece in found} == expected
    assert len(found) == count


@given(seed=SEEDS)
def test_a_link_tells_which_neighbours_are_inside(seed):
    inside = random_voxels(seed)
    voxel = tuple(np.random.default_rng(seed).integers(1, np.array(inside.shape) - 1).tolist())
    link = link_of(inside, voxel)
    for k, step in enumerate(NEIGHBOURS):
        assert bool(link >> k & 1) == inside[tuple(voxel + step)]


def test_a_block_without_tunnels_has_no_membranes():
    solid = block()
    ball = carved(slab(solid.shape), solid)
    assert find_membranes(ball, solid, ndimage.distance_transform_edt(~solid)) == []


def membranes_of(solid):
    distance = ndimage.distance_transform_edt(~solid)
    ball = carved(slab(solid.shape), solid)
    return ball, find_membranes(ball, solid, distance)


def test_membranes_come_with_the_widest_first_and_point_along_their_tunnels():
    _, membranes = membranes_of(block((8, 9, 2), (20, 14, 1), (21, 6, 0)))
    assert [membrane.voxel[:2] for membrane in membranes] == [(8, 9), (20, 14), (21, 6)]
    assert [membrane.width for membrane in membranes] == pytest.approx([6, 4, 2])
    for membrane in membranes:
        assert np.linalg.norm(membrane.direction) == pytest.approx(1)
        assert abs(membrane.direction[2]) > 0.99


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_direction_of_a_membrane_is_that_of_its_tunnel(axis):
    solid = np.moveaxis(block((12, 10, 2)), 2, axis).copy()
    _, (membrane,) = membranes_of(solid)
    assert abs(membrane.direction[axis]) > 0.99


def ragged(seed):
    noise = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=(14, 12, 10)), 1.0)
    solid = np.pad(noise > -0.3 * noise.std(), 3)
    labels, _ = ndimage.label(solid, STRUCTURE)
    largest = labels == np.bincount(labels[labels > 0]).argmax()
    return ndimage.binary_fill_holes(largest, STRUCTURE)


@given(seed=SEEDS)
@settings(max_examples=5)
def test_piercing_any_membrane_of_any_solid_opens_one_handle(seed):
    ball, membranes = membranes_of(ragged(seed))
    assert topology(ball) == (1, 1, 2)
    assert membranes
    for membrane in membranes:
        pierced = ball.copy()
        pierced[membrane.voxel] = False
        assert topology(pierced) == (1, 1, 0)
