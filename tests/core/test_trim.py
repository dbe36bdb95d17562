import numpy as np
import pytest
from scipy import ndimage

from flyreg_core.errors import MeshError
from flyreg_core.frame import BrainFrame
from flyreg_core.solid import VoxelSolid, kuhn_structure
from flyreg_core.trim import TrimParameters, TrimPlanes, find_trim_planes, plane_depth, trim

FRAME = BrainFrame(0, 1, 2)
ORIGIN, PITCH = np.array([-200.0, 50.0, 10.0]), 2.0
RIGHT_NECK, LEFT_NECK = -140.0, 146.0  # 30 and 173 voxels from the origin


def brain_with_lobes():
    """200 voxels wide and 60 high, but only 20 high at the necks."""
    inside = np.zeros((205, 64, 20), dtype=bool)
    inside[2:-2, 2:-2, 2:-2] = True
    for neck in (30, 173):
        inside[neck - 5 : neck + 6, 2:22] = False
        inside[neck - 5 : neck + 6, -22:-2] = False
        inside[neck, 22:24] = False
    return VoxelSolid(inside, ORIGIN, PITCH)


def test_the_planes_are_found_at_the_necks():
    planes = find_trim_planes(brain_with_lobes(), FRAME, TrimParameters())
    assert planes.right == pytest.approx(RIGHT_NECK, abs=3 * PITCH)
    assert planes.left == pytest.approx(LEFT_NECK, abs=3 * PITCH)


def test_the_mirror_image_has_mirrored_planes():
    solid = brain_with_lobes()
    mirrored = VoxelSolid(solid.inside[::-1].copy(), ORIGIN, PITCH)
    planes = find_trim_planes(solid, FRAME, TrimParameters())
    other = find_trim_planes(mirrored, FRAME, TrimParameters())
    middle = ORIGIN[0] + PITCH * 204 / 2
    assert other.right - middle == pytest.approx(middle - planes.left, abs=PITCH)
    assert other.left - middle == pytest.approx(middle - planes.right, abs=PITCH)


@pytest.mark.parametrize("axes", [(0, 1, 2), (1, 0, 2), (2, 1, 0), (1, 2, 0), (0, 2, 1), (2, 0, 1)])
def test_the_planes_do_not_depend_on_the_order_of_the_axes(axes):
    solid = brain_with_lobes()
    turned = VoxelSolid(solid.inside.transpose(axes), ORIGIN[list(axes)], PITCH)
    frame = BrainFrame(*(axes.index(axis) for axis in range(3)))
    parameters = TrimParameters()
    assert find_trim_planes(turned, frame, parameters) == find_trim_planes(solid, FRAME, parameters)


def test_a_plane_that_the_user_put_stays_there():
    solid = brain_with_lobes()
    found = find_trim_planes(solid, FRAME, TrimParameters())
    assert find_trim_planes(solid, FRAME, TrimParameters(right=-50.0)) == TrimPlanes(
        -50.0, found.left
    )
    assert find_trim_planes(solid, FRAME, TrimParameters(left=50.0)) == TrimPlanes(
        found.right, 50.0
    )


def test_what_lies_between_the_planes_stays_and_nothing_else():
    solid = brain_with_lobes()
    trimmed = trim(solid, FRAME, TrimPlanes(-100.0, 61.0))
    x = solid.coordinates(0)[:, None, None]
    assert np.array_equal(trimmed.inside, solid.inside & (x > -100) & (x < 61))
    assert (trimmed.origin == ORIGIN).all()
    assert trimmed.pitch == PITCH


def test_of_several_pieces_between_the_planes_the_largest_stays():
    solid = brain_with_lobes()
    inside = solid.inside.copy()
    inside[60] = False
    pieces = trim(VoxelSolid(inside, ORIGIN, PITCH), FRAME, TrimPlanes(-100.0, 150.0)).inside
    assert ndimage.label(pieces, kuhn_structure())[1] == 1
    assert np.flatnonzero(pieces.any(axis=(1, 2)))[0] == 61


def test_planes_beyond_the_brain_leave_nothing_and_are_told():
    words = (
        "nothing of the brain lies between the trim planes at 900 and 950 um; it spans -200 to "
        "208 um there, so move the planes"
    )
    with pytest.raises(MeshError, match=words):
        trim(brain_with_lobes(), FRAME, TrimPlanes(900.0, 950.0))


def test_depth_is_the_distance_to_the_nearer_plane_and_negative_beyond():
    points = np.array([[-12.0, 5, 5], [-9.0, 0, 0], [15.0, 0, 9], [22.0, 0, 0]])
    assert plane_depth(points, FRAME, TrimPlanes(-10.0, 20.0)).tolist() == [-2, 1, 5, -2]
    assert plane_depth(points, BrainFrame(2, 1, 0), TrimPlanes(-10.0, 20.0)).tolist() == [
        15,
        10,
        11,
        10,
    ]
