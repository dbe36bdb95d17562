from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from scipy import ndimage

from flyreg_core.handles import HandleParameters, open_oesophagus
from flyreg_core.pockets import DEPTH, WIDE, fill_pockets, pocket_depths
from flyreg_core.progress import ignore
from flyreg_core.solid import VoxelSolid, close_cracks, close_solid, kuhn_structure
from tests.core.test_handles import AUTOMATIC, SEEDS, block, genus, random_solid

TUNNEL = (23, 18, 2)
TOP = 3  # of the block
OPEN = int(DEPTH)  # layers of voxels whose depth is not more than that
DEEP = 6
EVERYWHERE = np.ones((1, 1, 1), dtype=bool)


def filled(solid, radius=1.5, handles=AUTOMATIC, is_main=EVERYWHERE):
    """The voxels of a solid with its pockets filled, and its carving before that."""
    closed = close_solid(solid, radius)
    carving = open_oesophagus(closed, handles, ignore)
    depths = pocket_depths(solid.inside)
    return fill_pockets(carving, closed, solid, depths, is_main, ignore).inside, carving


def with_slit(width, deep=DEEP) -> VoxelSolid:
    """A block with a tunnel, and a slit so many voxels wide and deep across its front."""
    solid = block(TUNNEL)
    inside = solid.inside.copy()
    inside[3:-3, 27 : 27 + width, TOP : TOP + deep] = False
    return replace(solid, inside=inside)


@pytest.mark.parametrize("width", [1, 2, 3, 4])
def test_a_slit_narrower_than_the_ball_stays_open_to_the_same_depth(width):
    solid = with_slit(width)
    inside, _ = filled(solid)
    slit = inside[10, 27 : 27 + width, TOP : TOP + DEEP]  # away from its ends
    bulge = int(WIDE)  # the ball bulges no farther into the widest of them
    assert not slit[:, :OPEN].any()
    assert slit[:, OPEN + bulge :].all()
    assert inside[solid.inside].all()


def test_a_chamber_behind_a_narrow_mouth_is_filled_however_wide_it_is():
    mouth = 4
    solid = with_slit(2, deep=mouth)
    inside = solid.inside.copy()
    chamber = (np.s_[8:17], np.s_[23:32], np.s_[TOP + mouth : TOP + mouth + 5])
    assert inside[chamber].all()
    inside[chamber] = False
    found, _ = filled(replace(solid, inside=inside))
    assert found[chamber].all()
    assert not found[10, 27:29, TOP : TOP + OPEN].any()


def test_a_slit_that_is_wider_than_the_ball_stays_as_it_is():
    solid = with_slit(7)
    assert (filled(solid)[0] == solid.inside).all()


@pytest.mark.parametrize("reach", [0, 1, 2, 3])
def test_nothing_is_filled_in_the_tunnel_that_stays_open(reach):
    solid = block((23, 18, reach))
    assert (filled(solid, radius=0.0)[0] == solid.inside).all()


def test_nothing_is_filled_where_the_brain_is_trimmed_off():
    solid = with_slit(4)
    is_main = np.arange(len(solid.inside))[:, None, None] >= 20
    inside, carving = filled(solid, is_main=is_main)
    added = inside & ~carving.solid.inside
    assert added[20:].any()
    assert not added[:20].any()


@settings(max_examples=10, deadline=None)
@given(SEEDS)
def test_one_handle_stays_one_handle_and_nothing_changes_next_to_its_membrane(seed):
    solid = random_solid(seed, -0.5)
    solid.inside[13:19, 10:16] = False  # so wide that closing leaves it
    x, y, z = map(float, solid.positions((np.array([15.5]), np.array([12.5]), np.array([8.5])))[0])
    inside, carving = filled(solid, 1.0, HandleParameters(hole=(x, y, z)))
    assert genus(inside) == genus(carving.solid.inside) == 1
    rim = ndimage.binary_dilation(carving.membrane, kuhn_structure())
    assert (inside == carving.solid.inside)[rim].all()


def test_depths_are_the_ways_through_a_pocket_from_the_open():
    solid = with_slit(1)
    depths = pocket_depths(solid.inside)
    assert depths[10, 27, TOP : TOP + DEEP] == pytest.approx(np.arange(DEEP))  # flush with its lid
    assert (depths[solid.inside] == 0).all()
    is_pocket = close_cracks(solid.inside, WIDE) & ~solid.inside
    assert ((depths > 0) == is_pocket).all()
