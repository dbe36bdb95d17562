from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from scipy import ndimage

from flyreg_core.handles import HandleParameters, open_oesophagus
from flyreg_core.pockets import (
    DEPTH,
    NARROW,
    WIDE,
    fill_pockets,
    local_thickness,
    pocket_depths,
)
from flyreg_core.progress import ignore
from flyreg_core.solid import VoxelSolid, close_solid, kuhn_structure
from tests.core.test_handles import AUTOMATIC, SEEDS, block, genus, random_solid

TUNNEL = (23, 18, 2)
TOP = 3  # of the block
SLIT = 23
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
    inside[3:-3, SLIT : SLIT + width, TOP : TOP + deep] = False
    return replace(solid, inside=inside)


def open_layers(width):
    """How many layers of a slit stay open, in its middle and away from its ends."""
    solid = with_slit(width)
    inside, _ = filled(solid)
    assert inside[solid.inside].all()
    return int((~inside[10, SLIT + width // 2, TOP : TOP + DEEP]).sum())


def test_a_crack_stays_open_as_deep_as_it_is_to_show():
    assert open_layers(1) in (OPEN, OPEN + 1)  # the ball bulges into its mouth


def test_the_wider_a_slit_is_the_deeper_it_stays_open():
    layers = [open_layers(width) for width in (1, 3, 5)]
    assert layers == sorted(layers)
    assert OPEN <= layers[0] < layers[-1] < DEEP


def test_a_chamber_behind_a_narrow_mouth_is_filled_however_wide_it_is():
    mouth = 4
    solid = with_slit(2, deep=mouth)
    inside = solid.inside.copy()
    chamber = (np.s_[8:17], np.s_[23:32], np.s_[TOP + mouth : TOP + mouth + 5])
    assert inside[chamber].all()
    inside[chamber] = False
    found, _ = filled(replace(solid, inside=inside))
    assert found[chamber].all()
    assert not found[10, SLIT : SLIT + 2, TOP : TOP + OPEN].any()


def test_a_slit_that_is_wider_than_the_ball_stays_as_it_is():
    solid = with_slit(2 * int(WIDE) - 1)
    floor = TOP + DEEP - 1  # whose edges are narrow
    assert (filled(solid)[0] == solid.inside)[:, :, :floor].all()


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


def test_in_a_crack_each_voxel_is_one_deeper_than_that_above():
    solid = with_slit(int(2 * NARROW) - 1)
    depths = pocket_depths(solid.inside)[10, SLIT, TOP : TOP + DEEP]
    assert 0 < depths[0] < depths[1] < OPEN  # the mouth, where the ball bulges in
    assert np.diff(depths[1:]) == pytest.approx(1.0)


@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_depths_are_found_in_pockets_alone_and_no_hollow_is_left_out(seed):
    inside = random_solid(seed, -0.5).inside
    depths = pocket_depths(inside)
    assert (depths[inside] == 0).all()
    is_wide = local_thickness(np.pad(~inside, 8, constant_values=True), WIDE) >= WIDE
    assert (depths[~inside & ~is_wide[(slice(8, -8),) * 3]] > 0).all()


@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_taking_voxels_away_makes_no_place_deeper(seed):
    inside = random_solid(seed, -0.5).inside
    less = inside & (np.random.default_rng(seed).uniform(size=inside.shape) > 0.02)
    before, after = pocket_depths(inside)[~inside], pocket_depths(less)[~inside]
    assert (after <= before + 1e-9).all()


@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_the_thickness_is_that_of_the_largest_ball_that_covers_a_place(seed):
    most = 3.0
    outside = ~random_solid(seed, -0.5).inside[:16, :12, :12]
    radius = np.minimum(ndimage.distance_transform_edt(outside), most)
    places, centers = np.argwhere(np.ones_like(outside)), np.argwhere(outside)
    squared = ((places[:, None] - centers[None]) ** 2).sum(axis=2)
    covering = np.where(squared < np.round(radius[outside] ** 2), radius[outside], 0.0)
    expected = np.where(outside, covering.max(axis=1).reshape(outside.shape), 0.0)
    assert local_thickness(outside, most) == pytest.approx(expected)
