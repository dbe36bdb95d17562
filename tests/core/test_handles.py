from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage
from scipy.spatial import cKDTree

from flyreg_core.errors import Cancelled, TopologyError
from flyreg_core.frame import ANTERO_POSTERIOR
from flyreg_core.handles import (
    HandleParameters,
    drill,
    find_thinnest_channel,
    open_oesophagus,
)
from flyreg_core.isosurface import extract_surface
from flyreg_core.progress import ignore
from flyreg_core.solid import VoxelSolid, kuhn_structure, largest_component
from tests.frames import UPRIGHT, random_frame

SEEDS = st.integers(0, 2**32 - 1)
AUTOMATIC = HandleParameters()
SIZE = (41, 30, 10)
MIDDLE = 3 + 20
PITCH = 2.5
ORIGIN = PITCH * np.array([-MIDDLE, -18.0, -8.0])  # voxel MIDDLE is on the midplane
FRAME = random_frame(8)
WIDEST = "widest clear tunnel near the middle of the midline"


def block(*tunnels, frame=FRAME):
    """A block 41 x 30 x 10 with tunnels from front to back: (x, y, half their width less a half)."""
    inside = np.zeros(np.add(SIZE, 6), dtype=bool)
    inside[3:-3, 3:-3, 3:-3] = True
    for x, y, reach in tunnels:
        inside[x - reach : x + reach + 1, y - reach : y + reach + 1] = False
    return VoxelSolid(inside, frame, ORIGIN, PITCH)


def place(*voxel):
    """Where a voxel of the block lies in the file."""
    x, y, z = map(float, FRAME.points(ORIGIN + PITCH * np.array(voxel)))
    return x, y, z


def opened(solid, parameters=AUTOMATIC):
    return open_oesophagus(solid, parameters, ignore)


def oesophagus(carving):
    (found,) = (handle for handle in carving.handles if handle.is_oesophagus)
    return found


def voxel_of(handle):
    return np.round((FRAME.coordinates(np.array(handle.center_um)) - ORIGIN) / PITCH).astype(int)


def genus(inside):
    """The number of handles, counted by another library; the surface must be one closed piece."""
    surface = extract_surface(np.where(inside, 1.0, -1.0), np.zeros(3), 1.0)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.is_watertight
    assert mesh.body_count == 1
    return 1 - mesh.euler_number // 2


def random_solid(seed, threshold, has_tunnel=True):
    """A ragged block, with a tunnel in the middle or not."""
    rng = np.random.default_rng(seed)
    noise = ndimage.gaussian_filter(rng.normal(size=(26, 20, 12)), 1.0)
    inside = np.zeros((32, 26, 18), dtype=bool)
    inside[3:-3, 3:-3, 3:-3] = noise > threshold * noise.std()
    if has_tunnel:
        inside[12:20, 8:18, 3:-3] = True
        inside[15:17, 11:15] = False
    origin = PITCH * np.array([-15.5, -12.5, -8.5])
    return VoxelSolid(largest_component(inside), FRAME, origin, PITCH)


@given(seed=SEEDS, threshold=st.floats(-1.5, 0.5))
@settings(max_examples=25)
def test_any_solid_with_a_tunnel_in_the_middle_comes_out_with_exactly_one_handle(seed, threshold):
    solid = random_solid(seed, threshold)
    carving = opened(solid)
    assert genus(carving.solid.inside) == 1
    assert (carving.solid.inside | ~solid.inside).all()


@given(seed=SEEDS, threshold=st.floats(-1.0, 0.3), share=st.tuples(*[st.floats(0, 1)] * 3))
@settings(max_examples=25)
def test_whatever_tunnel_is_pointed_at_it_alone_stays_open(seed, threshold, share):
    solid = random_solid(seed, threshold, has_tunnel=False)
    inner = np.array(share) * (np.array(solid.inside.shape) - 1)
    hole = tuple(FRAME.points(solid.origin + PITCH * inner).tolist())
    carving = opened(solid, HandleParameters(hole))
    assert genus(carving.solid.inside) == 1
    away = {
        handle: np.linalg.norm(np.subtract(handle.center_um, hole)) for handle in carving.handles
    }
    assert away[oesophagus(carving)] == min(away.values())
    assert not carving.is_guess


@given(seed=SEEDS)
@settings(max_examples=5)
def test_random_solids_have_many_handles_before(seed):
    assert genus(random_solid(seed, -0.5).inside) > 3


@given(seed=SEEDS, threshold=st.floats(-1.0, 0.3))
@settings(max_examples=10)
def test_the_membrane_alone_closes_the_oesophagus(seed, threshold):
    carving = opened(random_solid(seed, threshold))
    assert not (carving.membrane & carving.solid.inside).any()
    assert genus(carving.solid.inside | carving.membrane) == 0


@given(seed=SEEDS, threshold=st.floats(-1.0, 0.3))
@settings(max_examples=10)
def test_what_touches_the_membrane_from_behind_is_outside_and_never_touches_what_does_before(
    seed, threshold
):
    carving = opened(random_solid(seed, threshold))
    free = ~carving.solid.inside & ~carving.membrane
    around = ndimage.binary_dilation(carving.membrane, kuhn_structure()) & free
    assert carving.behind.any()
    assert not (carving.behind & ~around).any()
    before = around & ~carving.behind
    assert before.any()
    assert not (ndimage.binary_dilation(before, kuhn_structure()) & carving.behind).any()


def test_a_solid_with_one_tunnel_is_left_as_it_is():
    solid = block((MIDDLE, 15, 2))
    carving = opened(solid)
    assert np.array_equal(carving.solid.inside, solid.inside)
    assert carving.solid.frame is solid.frame
    assert carving.solid.origin.tolist() == ORIGIN.tolist()
    assert len(carving.handles) == 1


def test_each_tunnel_is_a_handle_and_the_middle_one_is_the_oesophagus():
    carving = opened(block((MIDDLE, 15, 2), (10, 10, 3), (36, 20, 1), (37, 10, 0)))
    assert len(carving.handles) == 4
    assert voxel_of(oesophagus(carving))[:2].tolist() == [MIDDLE, 15]
    assert genus(carving.solid.inside) == 1
    assert (carving.chosen_by, carving.is_guess) == (WIDEST, False)


def test_the_widest_handle_comes_first():
    handles = opened(block((MIDDLE, 15, 2), (10, 10, 3), (36, 20, 1))).handles
    assert [voxel_of(handle)[0] for handle in handles] == [10, MIDDLE, 36]


def test_the_width_of_a_handle_is_that_of_its_tunnel():
    handles = opened(block((MIDDLE, 15, 2), (10, 10, 3))).handles
    assert [handle.width_um / PITCH for handle in handles] == pytest.approx([7, 5], abs=1.01)


def test_other_tunnels_are_closed_by_thin_membranes():
    solid = block((MIDDLE, 15, 2), (10, 10, 3))
    filled = opened(solid).solid.inside & ~solid.inside
    channel = np.zeros_like(filled)
    channel[7:14, 7:14, 3:-3] = True
    assert not filled[~channel].any()
    assert 0 < filled.sum() <= 2 * 7 * 7


def test_a_groove_is_no_tunnel():
    inside = block((MIDDLE, 15, 2)).inside.copy()
    inside[10:13, :, :7] = False
    carving = opened(replace(block(), inside=inside))
    assert len(carving.handles) == 1
    assert np.array_equal(carving.solid.inside, inside)


def test_the_solid_that_was_given_is_not_changed():
    solid = block((MIDDLE, 15, 2), (10, 10, 3))
    opened(solid)
    assert np.array_equal(solid.inside, block((MIDDLE, 15, 2), (10, 10, 3)).inside)


def test_the_inside_is_one_piece_and_so_is_the_outside():
    inside = opened(block((MIDDLE, 15, 2), (10, 10, 3))).solid.inside
    assert ndimage.label(inside, kuhn_structure())[1] == 1
    assert ndimage.label(~inside, kuhn_structure())[1] == 1


def hourglass(narrow_layer):
    """A block whose tunnel is 9 wide but for one layer, where it is 3 wide; another is beside it."""
    inside = block((MIDDLE, 15, 4), (9, 10, 2)).inside.copy()
    inside[MIDDLE - 4 : MIDDLE + 5, 11:20, narrow_layer] = True
    inside[MIDDLE - 1 : MIDDLE + 2, 14:17, narrow_layer] = False
    return replace(block(), inside=inside)


@pytest.mark.parametrize("layer", [4, 7, 10])
def test_a_tunnel_is_measured_at_its_narrowest_place(layer):
    found = oesophagus(opened(hourglass(layer)))
    assert voxel_of(found).tolist() == [MIDDLE, 15, layer]
    assert found.width_um == pytest.approx(PITCH * 4, abs=0.01)  # between full voxels


@pytest.mark.parametrize("layer", [4, 7, 10])
def test_the_membrane_spans_the_oesophagus_there_and_behind_it_is_the_next_layer(layer):
    carving = opened(hourglass(layer))
    expected = [[MIDDLE + x, 15 + y, layer] for x in (-1, 0, 1) for y in (-1, 0, 1)]
    assert np.argwhere(carving.membrane).tolist() == expected
    behind = np.argwhere(carving.behind)
    assert set(behind[:, ANTERO_POSTERIOR].tolist()) == {layer + 1}
    assert {tuple(voxel) for voxel in np.add(expected, [0, 0, 1]).tolist()} <= {
        tuple(voxel) for voxel in behind.tolist()
    }


@pytest.mark.parametrize("is_mirrored", [False, True])
def test_nothing_depends_on_how_the_brain_lies_in_its_file(is_mirrored):
    tunnels = (MIDDLE - 1, 8, 1), (MIDDLE + 1, 20, 2), (10, 10, 3)
    there = random_frame(9, is_mirrored)
    one, other = (opened(block(*tunnels, frame=frame)) for frame in (UPRIGHT, there))
    for name in ("membrane", "behind", "is_guess", "chosen_by"):
        assert np.array_equal(getattr(one, name), getattr(other, name))
    assert np.array_equal(one.solid.inside, other.solid.inside)
    for here, elsewhere in zip(one.handles, other.handles, strict=True):
        assert elsewhere.center_um == pytest.approx(there.points(np.array(here.center_um)))
        assert elsewhere.direction == pytest.approx(np.array(here.direction) @ there.axes)
        assert elsewhere.is_candidate == here.is_candidate


def slanted(slope_x, slope_y):
    """A block with one tunnel 5 wide that leans by so many voxels a layer."""
    inside = block().inside.copy()
    for layer in range(inside.shape[2]):
        x = round(MIDDLE + slope_x * (layer - 7.5))
        y = round(17 + slope_y * (layer - 7.5))
        inside[x - 2 : x + 3, y - 2 : y + 3, layer] = False
    return replace(block(), inside=inside)


@pytest.mark.parametrize("slopes", [(0, 0), (0.5, 0), (0, 0.5), (-0.5, 0), (0, -0.5), (0.4, -0.4)])
def test_the_direction_is_about_that_of_the_tunnel_towards_the_back(slopes):
    found = oesophagus(opened(slanted(*slopes), HandleParameters(hole=place(MIDDLE, 17, 8))))
    direction = FRAME.axes @ np.array(found.direction)
    true = np.array([*slopes, 1.0])
    assert np.linalg.norm(direction) == pytest.approx(1)
    assert direction @ true / np.linalg.norm(true) > np.cos(np.deg2rad(45))


def test_the_direction_of_a_straight_tunnel_is_its_own():
    found = oesophagus(opened(block((MIDDLE, 15, 2))))
    assert found.direction == pytest.approx(FRAME.axes[ANTERO_POSTERIOR])


def across(axis):
    """A block with one tunnel in the middle along another axis, and one at the side to the back."""
    inside = block((8, 10, 2)).inside.copy()
    middle = [slice(MIDDLE - 1, MIDDLE + 2), slice(17, 20), slice(7, 10)]
    middle[axis] = slice(None)
    inside[tuple(middle)] = False
    return replace(block(), inside=inside)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_tunnel_that_does_not_run_from_front_to_back_is_no_candidate(axis):
    handles = opened(across(axis), HandleParameters(hole=place(8, 10, 8))).handles
    across_it = [handle for handle in handles if abs(voxel_of(handle)[0] - 8) > 4]
    assert across_it
    assert not any(handle.is_candidate for handle in across_it)
    for handle in across_it:
        assert abs(FRAME.axes[axis] @ np.array(handle.direction)) > 0.95


def test_a_candidate_is_near_the_midline_and_in_the_middle_of_it():
    tunnels = (MIDDLE, 15, 2), (MIDDLE + 3, 22, 1), (MIDDLE + 8, 15, 1), (MIDDLE - 1, 6, 1)
    handles = opened(block(*tunnels, (MIDDLE + 1, 29, 1))).handles
    found = {
        tuple((voxel_of(handle)[:2] - [MIDDLE, 0]).tolist()): (
            handle.is_near_midline,
            handle.is_candidate,
        )
        for handle in handles
    }
    assert found == {
        (0, 15): (True, True),
        (3, 22): (True, True),
        (8, 15): (False, False),
        (-1, 6): (True, False),  # too far dorsal
        (1, 29): (True, False),  # too far ventral
    }


def test_a_tunnel_right_through_is_as_clear_as_can_be_and_one_in_a_thick_place_is_not():
    inside = block((MIDDLE, 15, 2)).inside.copy()
    inside[9:12, 9:12, 7:9] = inside[9:12, :12, 7:9] = inside[10, 10, 2:9] = False  # bent
    straight, bent = sorted(
        opened(replace(block(), inside=inside)).handles, key=lambda handle: -voxel_of(handle)[0]
    )
    assert straight.clearness == 1
    assert bent.clearness < 1


def test_of_two_tunnels_near_the_midline_the_wider_is_the_oesophagus():
    carving = opened(block((MIDDLE - 1, 14, 1), (MIDDLE + 1, 21, 2)))
    assert voxel_of(oesophagus(carving))[1] == 21
    assert len(carving.handles) == 2


@pytest.mark.parametrize(("reach", "is_guess"), [(0, False), (2, True), (3, True)])
def test_the_choice_is_a_guess_if_another_candidate_is_about_as_wide(reach, is_guess):
    carving = opened(block((MIDDLE, 13, reach), (MIDDLE, 21, 3)))
    assert carving.is_guess == is_guess
    assert voxel_of(oesophagus(carving))[1] == 21 or reach == 3


def test_a_wide_tunnel_at_the_side_makes_no_guess_of_the_choice():
    assert not opened(block((MIDDLE, 15, 2), (9, 15, 3))).is_guess


@pytest.mark.parametrize("pointed", [0, 1, 2])
def test_the_tunnel_that_is_pointed_at_stays_open_wherever_it_lies(pointed):
    tunnels = (MIDDLE, 15, 2), (10, 10, 3), (36, 20, 1)
    x, y, _ = tunnels[pointed]
    solid = block(*tunnels)
    carving = opened(solid, HandleParameters(hole=place(x + 1, y - 1, 5)))
    assert voxel_of(oesophagus(carving))[:2].tolist() == [x, y]
    assert (carving.chosen_by, carving.is_guess) == ("pointed at by the user", False)
    filled = carving.solid.inside & ~solid.inside
    assert not filled[x - 5 : x + 6, y - 5 : y + 6].any()


def test_pointing_ends_the_guessing():
    solid = block((MIDDLE, 13, 3), (MIDDLE, 22, 3))
    assert opened(solid).is_guess
    assert not opened(solid, HandleParameters(hole=place(MIDDLE, 22, 8))).is_guess


def test_a_tunnel_that_the_user_closed_is_not_taken():
    solid = block((MIDDLE, 13, 3), (MIDDLE, 22, 3), (10, 15, 3))
    carving = opened(solid, HandleParameters(closed=(place(MIDDLE, 22, 8), place(10, 15, 8))))
    assert voxel_of(oesophagus(carving))[:2].tolist() == [MIDDLE, 13]
    assert not carving.is_guess
    assert len(carving.handles) == 3


def test_pointing_outweighs_closing():
    solid, here = block((MIDDLE, 13, 3), (MIDDLE, 22, 3)), place(MIDDLE, 22, 8)
    carving = opened(solid, HandleParameters(hole=here, closed=(here,)))
    assert voxel_of(oesophagus(carving))[1] == 22


def test_a_brain_all_of_whose_tunnels_are_closed_has_no_oesophagus():
    solid = block((MIDDLE, 13, 3), (MIDDLE, 22, 3))
    shut = HandleParameters(closed=(place(MIDDLE, 13, 8), place(MIDDLE, 22, 8)))
    with pytest.raises(TopologyError, match="none of the 2 tunnels through the main brain is"):
        opened(solid, shut)


def test_a_solid_without_any_tunnel_has_no_oesophagus_and_the_remedy_is_told():
    words = (
        "the main brain has no tunnel, so there is no oesophagus; drill a channel for it from the "
        "front to the back, or check the trim planes and the resolution"
    )
    with pytest.raises(TopologyError, match=words):
        opened(block())


def test_a_solid_with_a_tunnel_at_the_side_alone_cannot_be_told_and_the_remedy_is():
    words = (
        "none of the 2 tunnels through the main brain is central, near its midline and clear from "
        "front to back, so the oesophagus cannot be told; point at one of them, or drill a channel "
        "from the front to the back"
    )
    with pytest.raises(TopologyError, match=words):
        opened(block((10, 10, 2), (36, 20, 2)))


SIDES = st.tuples(st.floats(8, 38), st.floats(8, 28), st.floats(8, 38), st.floats(8, 28))


@given(ends=SIDES)
@settings(max_examples=25)
def test_a_block_without_any_tunnel_drilled_from_front_to_back_has_one_handle(ends):
    x, y, other_x, other_y = ends
    drills = HandleParameters(drills=((place(x, y, 2), place(other_x, other_y, 13)),))
    drilled = drill(block(), drills)
    assert genus(drilled.inside) == 1
    carving = opened(drilled, drills)
    assert np.array_equal(carving.solid.inside, drilled.inside)
    assert (carving.chosen_by, carving.is_guess) == ("drilled by the user", False)


@given(ends=SIDES)
@settings(max_examples=25)
def test_drilling_takes_what_lies_within_its_radius_of_the_channel_and_beyond(ends):
    x, y, other_x, other_y = ends
    start, end = np.array([x, y, 5.0]), np.array([other_x, other_y, 10.0])
    drilled = drill(block(), HandleParameters(drills=((place(*start), place(*end)),)))
    way = (end - start) / np.linalg.norm(end - start)
    along = np.linspace(start - 3 * way, end + 3 * way, 1001)
    away, _ = cKDTree(along).query(np.argwhere(block().inside))
    left = drilled.inside[tuple(np.argwhere(block().inside).T)]
    clear = np.abs(away - 1.5) > 2e-3  # between two of the points along
    assert clear.mean() > 0.95
    assert np.array_equal(left[clear], (away > 1.5)[clear])


def test_drilling_does_not_change_what_it_was_given_and_nothing_drilled_is_the_same():
    solid = block((MIDDLE, 15, 2))
    drill(solid, HandleParameters(drills=((place(8, 8, 2), place(8, 8, 13)),)))
    assert np.array_equal(solid.inside, block((MIDDLE, 15, 2)).inside)
    assert np.array_equal(drill(solid, AUTOMATIC).inside, solid.inside)


def test_the_drilled_channel_is_taken_although_a_wider_tunnel_is_there():
    drills = HandleParameters(drills=((place(36, 20, 2), place(36, 20, 13)),))
    carving = opened(drill(block((MIDDLE, 15, 3)), drills), drills)
    assert voxel_of(oesophagus(carving))[:2].tolist() == [36, 20]
    assert genus(carving.solid.inside) == 1


def test_pointing_outweighs_drilling():
    drills = ((place(36, 20, 2), place(36, 20, 13)),)
    both = HandleParameters(hole=place(MIDDLE, 15, 8), drills=drills)
    carving = opened(drill(block((MIDDLE, 15, 3)), both), both)
    assert voxel_of(oesophagus(carving))[:2].tolist() == [MIDDLE, 15]


def test_a_click_twice_at_one_place_drills_no_further_than_there():
    here = place(20, 15, 8)
    drilled = drill(block(), HandleParameters(drills=((here, here),)))
    gone = np.argwhere(block().inside & ~drilled.inside)
    assert len(gone)
    assert (np.linalg.norm(gone - [20, 15, 8], axis=1) <= 1.5).all()


def test_opening_the_oesophagus_can_be_cancelled():
    def cancel(fraction, text):
        raise Cancelled

    with pytest.raises(Cancelled):
        open_oesophagus(block((MIDDLE, 15, 2)), AUTOMATIC, cancel)


def thin_at(x, y, layers):
    """A block without tunnels of which only so many layers are left in one place."""
    inside = block().inside.copy()
    inside[x - 3 : x + 4, y - 3 : y + 4, 3 + layers :] = False
    return replace(block(), inside=inside)


@pytest.mark.parametrize("layers", [1, 2, 3])
def test_a_channel_through_the_thinnest_place_of_the_midline_makes_one_handle(layers):
    solid = thin_at(MIDDLE, 17, layers)
    channel = find_thinnest_channel(solid)
    ends = [np.round((FRAME.coordinates(np.array(end)) - ORIGIN) / PITCH) for end in channel]
    assert np.abs(np.array(ends)[:, :2] - [MIDDLE, 17]).max() <= 1
    assert [end[2] for end in ends] == [3, 2 + layers]
    drills = HandleParameters(drills=(channel,))
    carving = opened(drill(solid, drills), drills)
    assert genus(carving.solid.inside) == 1


@pytest.mark.parametrize("thin", [(MIDDLE + 10, 17), (MIDDLE, 6), (MIDDLE, 29)])
def test_a_brain_as_thick_in_the_middle_of_its_midline_as_elsewhere_has_no_thinnest_channel(thin):
    assert find_thinnest_channel(block()) is None
    assert find_thinnest_channel(thin_at(*thin, 2)) is None


def test_a_solid_beside_its_midplane_has_no_midline_and_is_told():
    solid = block((MIDDLE, 15, 2))
    beside = replace(solid, origin=np.add(solid.origin, [1000, 0, 0]))
    with pytest.raises(TopologyError, match="the main brain does not reach the plane of its sym"):
        opened(beside)
