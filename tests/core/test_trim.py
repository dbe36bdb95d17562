import numpy as np
import pytest
from scipy import ndimage

from flyreg_core.errors import MeshError
from flyreg_core.frame import LEFT_RIGHT
from flyreg_core.solid import VoxelSolid, kuhn_structure
from flyreg_core.trim import TrimParameters, TrimPlanes, find_trim_planes, plane_depth, trim
from tests.frames import UPRIGHT, random_frame

ORIGIN, PITCH = np.array([-200.0, 50.0, 10.0]), 2.0
RIGHT_NECK, LEFT_NECK = -140.0, 146.0  # 30 and 173 voxels from the origin


def brain_with_lobes(frame=UPRIGHT):
    """200 voxels wide and 60 high, but only 20 high at the necks."""
    inside = np.zeros((205, 64, 20), dtype=bool)
    inside[2:-2, 2:-2, 2:-2] = True
    for neck in (30, 173):
        inside[neck - 5 : neck + 6, 2:22] = False
        inside[neck - 5 : neck + 6, -22:-2] = False
        inside[neck, 22:24] = False
    return VoxelSolid(inside, frame, ORIGIN, PITCH)


def test_the_planes_are_found_at_the_necks():
    planes = find_trim_planes(brain_with_lobes(), TrimParameters())
    assert planes.right == pytest.approx(RIGHT_NECK, abs=3 * PITCH)
    assert planes.left == pytest.approx(LEFT_NECK, abs=3 * PITCH)


def test_the_mirror_image_has_mirrored_planes():
    solid = brain_with_lobes()
    mirrored = VoxelSolid(solid.inside[::-1].copy(), UPRIGHT, ORIGIN, PITCH)
    planes = find_trim_planes(solid, TrimParameters())
    other = find_trim_planes(mirrored, TrimParameters())
    middle = ORIGIN[0] + PITCH * 204 / 2
    assert other.right - middle == pytest.approx(middle - planes.left, abs=PITCH)
    assert other.left - middle == pytest.approx(middle - planes.right, abs=PITCH)


@pytest.mark.parametrize("is_mirrored", [False, True])
def test_the_planes_do_not_depend_on_how_the_brain_lies_in_its_file(is_mirrored):
    turned = brain_with_lobes(random_frame(1, is_mirrored))
    planes = find_trim_planes(turned, TrimParameters())
    assert planes == find_trim_planes(brain_with_lobes(), TrimParameters())


def test_a_plane_that_the_user_put_stays_there():
    solid = brain_with_lobes()
    found = find_trim_planes(solid, TrimParameters())
    assert find_trim_planes(solid, TrimParameters(right=-50.0)) == TrimPlanes(-50.0, found.left)
    assert find_trim_planes(solid, TrimParameters(left=50.0)) == TrimPlanes(found.right, 50.0)


def test_what_lies_between_the_planes_stays_and_nothing_else():
    solid = brain_with_lobes()
    trimmed = trim(solid, TrimPlanes(-100.0, 61.0))
    x = solid.coordinates(LEFT_RIGHT)[:, None, None]
    assert np.array_equal(trimmed.inside, solid.inside & (x > -100) & (x < 61))
    assert (trimmed.origin == ORIGIN).all()
    assert trimmed.pitch == PITCH
    assert trimmed.frame is solid.frame


@pytest.mark.parametrize("is_mirrored", [False, True])
def test_the_planes_bound_the_places_of_the_voxels_in_the_frame_of_the_animal(is_mirrored):
    frame = random_frame(2, is_mirrored)
    trimmed = trim(brain_with_lobes(frame), TrimPlanes(-100.0, 61.0))
    places = trimmed.positions(np.nonzero(trimmed.inside))
    along_left = (places - frame.origin) @ frame.axes[LEFT_RIGHT]
    assert (along_left.min(), along_left.max()) == pytest.approx((-98, 60))


def test_of_several_pieces_between_the_planes_the_largest_stays():
    solid = brain_with_lobes()
    inside = solid.inside.copy()
    inside[60] = False
    two = VoxelSolid(inside, UPRIGHT, ORIGIN, PITCH)
    pieces = trim(two, TrimPlanes(-100.0, 150.0)).inside
    assert ndimage.label(pieces, kuhn_structure())[1] == 1
    assert np.flatnonzero(pieces.any(axis=(1, 2)))[0] == 61


def test_planes_beyond_the_brain_leave_nothing_and_are_told():
    words = (
        "nothing of the brain lies between the trim planes at 900 and 950 um; it spans -200 to "
        "208 um there, so move the planes"
    )
    with pytest.raises(MeshError, match=words):
        trim(brain_with_lobes(), TrimPlanes(900.0, 950.0))


@pytest.mark.parametrize("seed", [None, 3])
def test_depth_is_the_distance_to_the_nearer_plane_and_negative_beyond(seed):
    frame = UPRIGHT if seed is None else random_frame(seed)
    solid = VoxelSolid(np.ones((6, 3, 4), dtype=bool), frame, np.array([-12.0, 7.0, 9.0]), 7.0)
    assert plane_depth(solid, TrimPlanes(-10.0, 20.0)).tolist() == [-2, 5, 12, 11, 4, -3]


def test_voxels_with_a_positive_depth_are_those_that_stay():
    solid, planes = brain_with_lobes(), TrimPlanes(-100.0, 60.0)
    is_between = (plane_depth(solid, planes) > 0)[:, None, None]
    assert np.array_equal(trim(solid, planes).inside, solid.inside & is_between)
