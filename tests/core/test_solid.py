import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from flyreg_core.errors import Cancelled, MeshError
from flyreg_core.frame import DORSO_VENTRAL
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.progress import ignore
from flyreg_core.solid import (
    SolidParameters,
    VoxelSolid,
    close_cracks,
    close_solid,
    kuhn_structure,
    largest_component,
    voxelize,
)
from flyreg_core.topology import euler_characteristic
from tests.frames import UPRIGHT, laid, random_frame
from tests.shapes import box, inside_out, sphere, together

SEEDS = st.integers(0, 2**32 - 1)
SIZE = np.array([60.0, 30.0, 15.0])
RAW = SolidParameters(voxels_across=20)


def centres(solid):
    return solid.positions(tuple(np.indices(solid.inside.shape)))


def stretched(shape, factors=(3.0, 2.0, 1.0)):
    return shape[0] * factors, shape[1]


def assert_inside_box(solid, size):
    """Inside where the centre is in the box; on its faces either will do."""
    away = (np.abs(centres(solid)) - size / 2).max(axis=-1)
    clear = np.abs(away) > 1e-6
    assert clear.mean() > 0.5
    assert np.array_equal(solid.inside[clear], (away < 0)[clear])


def random_voxels(seed, share=0.5, shape=(9, 8, 7)):
    return np.pad(np.random.default_rng(seed).uniform(size=shape) < share, 1)


def test_voxels_are_neighbours_where_one_is_beyond_the_other_on_every_axis_or_none():
    structure = kuhn_structure()
    for step in np.ndindex(3, 3, 3):
        offset = np.array(step) - 1
        assert structure[step] == ((offset >= 0).all() or (offset <= 0).all())


def test_the_neighbours_of_a_voxel_form_a_sphere():
    structure = kuhn_structure()
    around = [np.array(s) - 1 for s in np.argwhere(structure).tolist() if s != [1, 1, 1]]

    def adjacent(i, j):
        step = around[i] - around[j] + 1
        return (step >= 0).all() and (step <= 2).all() and structure[tuple(step)]

    faces = [
        (i, j, k)
        for i in range(14)
        for j in range(i)
        for k in range(j)
        if adjacent(i, j) and adjacent(j, k) and adjacent(i, k)
    ]
    assert len(around) == 14
    assert euler_characteristic(np.array(faces)) == 2


def test_a_voxel_of_a_box_is_inside_where_its_centre_is():
    solid = voxelize(SurfaceMesh(*box(tuple(SIZE))), UPRIGHT, RAW, ignore)
    assert_inside_box(solid, SIZE)


def test_a_voxel_of_an_ellipsoid_is_inside_where_its_centre_is():
    solid = voxelize(SurfaceMesh(*stretched(sphere(10.0, rounds=5))), UPRIGHT, RAW, ignore)
    radius = np.linalg.norm(centres(solid) / [3, 2, 1], axis=-1)
    clear = np.abs(radius - 10) > 0.02
    assert clear.mean() > 0.95
    assert np.array_equal(solid.inside[clear], (radius < 10)[clear])


def lopsided():
    """An ellipsoid with an ear, unlike its mirror image on any axis."""
    ear = sphere(8.0)[0] + np.array([20.0, 19.0, 5.0]), sphere(8.0)[1]
    return SurfaceMesh(*together(stretched(sphere(10.0, rounds=4)), ear))


@given(seed=SEEDS, is_mirrored=st.booleans())
@settings(max_examples=10)
def test_a_brain_gets_the_same_voxels_however_it_lies_in_its_file(seed, is_mirrored):
    frame = random_frame(seed, is_mirrored)
    one = voxelize(lopsided(), UPRIGHT, RAW, ignore)
    other = voxelize(laid(lopsided(), frame), frame, RAW, ignore)
    assert other.inside.shape == one.inside.shape
    assert other.pitch == pytest.approx(one.pitch)
    assert other.origin == pytest.approx(one.origin)
    assert (other.inside != one.inside).sum() <= 0.002 * one.inside.sum()  # touched by the surface


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_brain_and_its_mirror_image_get_mirrored_voxels(axis):
    factors = np.where(np.arange(3) == axis, -1.0, 1.0)
    mesh = lopsided()
    mirrored = SurfaceMesh(mesh.vertices * factors, mesh.faces[:, ::-1])
    one, other = (voxelize(brain, UPRIGHT, RAW, ignore) for brain in (mesh, mirrored))
    turned = np.flip(other.inside, axis)
    assert turned.shape == one.inside.shape
    assert other.coordinates(axis)[::-1] == pytest.approx(-one.coordinates(axis))
    assert (turned != one.inside).sum() <= 0.002 * one.inside.sum()


@given(scale=st.floats(1e-3, 1e3))
@settings(max_examples=10)
def test_a_brain_of_any_size_gets_the_same_voxels(scale):
    mesh = lopsided()
    one = voxelize(mesh, UPRIGHT, RAW, ignore)
    other = voxelize(SurfaceMesh(scale * mesh.vertices, mesh.faces), UPRIGHT, RAW, ignore)
    assert other.pitch == pytest.approx(scale * one.pitch)
    assert (other.inside != one.inside).sum() <= 0.002 * one.inside.sum()


def test_the_height_of_the_brain_is_measured_in_its_own_frame():
    frame = random_frame(5)
    solid = voxelize(laid(SurfaceMesh(*box(tuple(SIZE))), frame), frame, RAW, ignore)
    assert solid.pitch == pytest.approx(SIZE[DORSO_VENTRAL] / 20)


def test_the_brain_is_as_many_voxels_high_as_asked_for():
    solid = voxelize(
        SurfaceMesh(*box(tuple(SIZE))), UPRIGHT, SolidParameters(voxels_across=24), ignore
    )
    assert solid.pitch == pytest.approx(30 / 24)
    assert 23 <= solid.inside.any(axis=(0, 2)).sum() <= 25


def test_the_outermost_layer_is_outside():
    solid = voxelize(
        SurfaceMesh(*stretched(sphere(10.0))), UPRIGHT, SolidParameters(voxels_across=17), ignore
    )
    within = np.zeros_like(solid.inside)
    within[1:-1, 1:-1, 1:-1] = True
    assert solid.inside.any()
    assert not solid.inside[~within].any()


def test_a_missing_face_hardly_changes_the_solid():
    whole = SurfaceMesh(*stretched(sphere(10.0, rounds=4)))
    torn = SurfaceMesh(whole.vertices, whole.faces[1:])
    one, other = (voxelize(mesh, UPRIGHT, RAW, ignore).inside for mesh in (whole, torn))
    assert (one != other).sum() <= 0.001 * one.sum()


def test_half_an_ellipsoid_without_its_base_is_solid_up_to_the_base():
    # from any point of the base the dome fills half of the view: winding number one half
    vertices, faces = stretched(sphere(10.0, rounds=4), (3.0, 2.0, 1.9))
    dome = SurfaceMesh(vertices, faces[(vertices[faces, 2] >= -1e-9).all(axis=1)])
    solid = voxelize(dome, UPRIGHT, SolidParameters(30), ignore)
    z = centres(solid)[..., 2]
    away = np.linalg.norm(centres(solid) / [3, 2, 1.9], axis=-1) - 10
    clear = (np.abs(away) > 0.2) & (np.abs(z) > 0.3 * solid.pitch)
    assert np.array_equal(solid.inside[clear], ((away < 0) & (z > 0))[clear])


def test_surfaces_that_cross_enclose_their_union():
    left, right = box((40.0, 30.0, 15.0), (-10, 0, 0)), box((40.0, 30.0, 15.0), (10, 0, 0))
    solid = voxelize(SurfaceMesh(*together(left, right)), UPRIGHT, RAW, ignore)
    assert_inside_box(solid, SIZE)


def test_closing_leaves_out_a_speck_beside_the_brain():
    with_speck = together(box(tuple(SIZE)), box((4.0, 4.0, 4.0), (40, 0, 0)))
    solid = voxelize(SurfaceMesh(*with_speck), UPRIGHT, RAW, ignore)
    assert ndimage.label(solid.inside, kuhn_structure())[1] == 2
    assert_inside_box(close_solid(solid, 0.0), SIZE)


def test_closing_fills_cavities_and_cracks_and_keeps_the_place():
    inside = np.zeros((16, 16, 16), dtype=bool)
    inside[2:-2, 2:-2, 2:-2] = True
    inside[6, 6, 6] = inside[9:11, :8] = False
    solid = VoxelSolid(inside, UPRIGHT, np.array([1.0, 2.0, 3.0]), 0.5)
    closed = close_solid(solid, 1.0)
    assert closed.inside[6, 6, 6]
    assert closed.inside[9:11, 4, 8].all()
    assert not close_solid(solid, 0.0).inside[9:11, 4, 8].any()
    assert (closed.origin.tolist(), closed.pitch) == ([1, 2, 3], 0.5)


def test_a_surface_turned_inside_out_encloses_nothing():
    with pytest.raises(MeshError, match="the surface encloses nothing at this resolution, or is"):
        voxelize(SurfaceMesh(*inside_out(box(tuple(SIZE)))), UPRIGHT, RAW, ignore)


def test_finding_the_inside_can_be_cancelled():
    def cancel(fraction, text):
        raise Cancelled

    with pytest.raises(Cancelled):
        voxelize(SurfaceMesh(*box(tuple(SIZE))), UPRIGHT, RAW, cancel)


def test_positions_and_coordinates_agree():
    solid = VoxelSolid(np.ones((2, 3, 4), dtype=bool), UPRIGHT, np.array([10.0, 20.0, 30.0]), 0.5)
    assert solid.positions(tuple(np.array([[1], [2], [3]]))).tolist() == [[10.5, 21.0, 31.5]]
    assert solid.coordinates(1).tolist() == [20.0, 20.5, 21.0]


@given(seed=SEEDS, is_mirrored=st.booleans())
def test_the_voxel_nearest_to_a_place_is_the_one_that_has_it(seed, is_mirrored):
    rng = np.random.default_rng(seed)
    shape = (5, 6, 7)
    solid = VoxelSolid(
        np.ones(shape, dtype=bool),
        random_frame(seed, is_mirrored),
        rng.uniform(-100, 100, 3),
        rng.uniform(0.1, 10),
    )
    index = rng.integers(0, shape, (20, 3))
    places = solid.positions(tuple(index.T))
    assert np.array_equal(solid.voxels(places), index)
    nudge = rng.uniform(-1, 1, (20, 3))
    nudge *= 0.49 * solid.pitch / np.linalg.norm(nudge, axis=1, keepdims=True)
    assert np.array_equal(solid.voxels(places + nudge), index)


def test_a_place_beside_the_grid_has_the_voxel_at_its_edge():
    solid = VoxelSolid(np.ones((2, 3, 4), dtype=bool), UPRIGHT, np.zeros(3), 1.0)
    assert solid.voxels(np.array([[-50.0, 1.2, 50.0]])).tolist() == [[0, 1, 3]]


def test_positions_lie_in_the_file_as_the_frame_says():
    frame = random_frame(6, is_mirrored=True)
    solid = VoxelSolid(np.ones((2, 3, 4), dtype=bool), frame, np.array([10.0, 20.0, 30.0]), 0.5)
    place = solid.positions(tuple(np.array([[1], [2], [3]])))[0]
    steps = frame.axes.T @ np.array([10.5, 21.0, 31.5])
    assert place == pytest.approx(frame.origin + steps)


@given(seed=SEEDS, radius=st.sampled_from([0.0, 1.0, 1.5, 2.0, 3.0]))
@settings(max_examples=25)
def test_closing_agrees_with_another_library(seed, radius):
    inside = random_voxels(seed, 0.1)
    reach = int(radius)
    ball = np.linalg.norm(np.indices((2 * reach + 1,) * 3) - reach, axis=0) <= radius
    expected = ndimage.binary_closing(np.pad(inside, 5), ball)[(slice(5, -5),) * 3]
    assert np.array_equal(close_cracks(inside, radius), expected)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    ("width", "radius", "closed"), [(1, 0, 0), (2, 1, 1), (3, 1, 0), (4, 2, 1)]
)
def test_cracks_up_to_twice_as_wide_as_the_radius_are_closed(axis, width, radius, closed):
    inside = np.zeros((24, 24, 24), dtype=bool)
    inside[4:-4, 4:-4, 4:-4] = True
    crack = [slice(10, 14)] * 3
    crack[axis] = slice(10, 10 + width)
    crack[(axis + 1) % 3] = slice(None)
    inside[tuple(crack)] = False
    assert close_cracks(inside, radius)[12, 12, 12] if closed else True
    middle = [12, 12, 12]
    middle[axis] = 10 + width // 2
    assert close_cracks(inside, radius)[tuple(middle)] == bool(closed)


@pytest.mark.parametrize(("step", "joined"), [((1, 1, 0), 1), ((1, 1, 1), 1), ((1, -1, 0), 0)])
def test_voxels_that_touch_across_a_diagonal_are_one_piece_only_if_they_are_neighbours(
    step, joined
):
    inside = np.zeros((5, 5, 5), dtype=bool)
    inside[2, 2, 2] = inside[tuple(np.array([2, 2, 2]) + step)] = True
    assert largest_component(inside).sum() == 1 + joined


@given(seed=SEEDS, share=st.floats(0.2, 0.9))
def test_the_largest_component_is_one_piece_around_one_outside(seed, share):
    inside = random_voxels(seed, share)
    result = largest_component(inside)
    assert ndimage.label(result, kuhn_structure())[1] == 1
    assert ndimage.label(~result, kuhn_structure())[1] == 1
    labels, count = ndimage.label(inside, kuhn_structure())
    largest = max(int((labels == k).sum()) for k in range(1, count + 1))
    assert (result & inside).sum() >= largest


def test_cavities_are_filled():
    inside = np.zeros((7, 7, 7), dtype=bool)
    inside[1:-1, 1:-1, 1:-1] = True
    inside[3, 3, 3] = False
    assert largest_component(inside).sum() == 125


@pytest.mark.parametrize("across", [7, 0, -3])
def test_too_few_voxels_to_show_a_brain_are_refused(across):
    words = f"{across} voxels across cannot show a brain; use at least 8"
    with pytest.raises(MeshError, match=words):
        voxelize(SurfaceMesh(*box(tuple(SIZE))), UPRIGHT, SolidParameters(across), ignore)
