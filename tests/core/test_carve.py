import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from flyreg_core.carve import carve
from flyreg_core.errors import TopologyError
from flyreg_core.frame import BrainFrame
from flyreg_core.isosurface import extract_surface
from flyreg_core.progress import ignore
from flyreg_core.solid import VoxelSolid, kuhn_structure, largest_component

SEEDS = st.integers(0, 2**32 - 1)
FRAME = BrainFrame(0, 1, 2)
ORIGIN, PITCH = np.array([100.0, 200.0, 300.0]), 2.5
SIZE = (41, 30, 10)
MIDDLE = 3 + 20


def block(*tunnels):
    """A block 41 x 30 x 10 with tunnels along z: (x, y, half of their width less one half)."""
    inside = np.zeros(np.add(SIZE, 6), dtype=bool)
    inside[3:-3, 3:-3, 3:-3] = True
    for x, y, reach in tunnels:
        inside[x - reach : x + reach + 1, y - reach : y + reach + 1] = False
    return VoxelSolid(inside, ORIGIN, PITCH)


def surface_of(solid):
    return extract_surface(np.where(solid.inside, 1.0, -1.0), solid.origin, solid.pitch)


def handles_of(solid):
    """The number of handles, counted by another library; the surface must be one closed piece."""
    surface = surface_of(solid)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.is_watertight
    assert mesh.body_count == 1
    return 1 - mesh.euler_number // 2


def random_solid(seed, threshold):
    """A ragged block with a tunnel in the middle."""
    rng = np.random.default_rng(seed)
    noise = ndimage.gaussian_filter(rng.normal(size=(26, 20, 12)), 1.0)
    inside = np.zeros((32, 26, 18), dtype=bool)
    inside[3:-3, 3:-3, 3:-3] = noise > threshold * noise.std()
    inside[12:20, 8:18, 3:-3] = True
    inside[15:17, 11:15] = False
    return VoxelSolid(largest_component(inside), ORIGIN, PITCH)


@given(seed=SEEDS, threshold=st.floats(-1.5, 0.5))
@settings(max_examples=40)
def test_any_solid_with_a_tunnel_in_the_middle_comes_out_with_exactly_one_handle(seed, threshold):
    solid = random_solid(seed, threshold)
    carving = carve(solid, FRAME, ignore)
    assert handles_of(carving.solid) == 1
    assert (carving.solid.inside | ~solid.inside).all()
    assert np.array_equal(carving.filled, carving.solid.inside & ~solid.inside)


@given(seed=SEEDS)
@settings(max_examples=10)
def test_random_solids_have_many_handles_before(seed):
    assert handles_of(random_solid(seed, -0.5)) > 3


def test_a_solid_with_one_tunnel_is_left_as_it_is():
    carving = carve(block((MIDDLE, 15, 2)), FRAME, ignore)
    assert np.array_equal(carving.solid.inside, block((MIDDLE, 15, 2)).inside)
    assert not carving.filled.any()


def test_each_tunnel_is_a_handle_and_the_middle_one_is_the_oesophagus():
    carving = carve(block((MIDDLE, 15, 2), (10, 10, 3), (36, 20, 1), (37, 10, 0)), FRAME, ignore)
    assert len(carving.handles) == 4
    assert [handle.is_oesophagus for handle in carving.handles].count(True) == 1
    assert carving.oesophagus.center_um[:2] == pytest.approx(
        ORIGIN[:2] + PITCH * np.array([MIDDLE, 15])
    )
    assert handles_of(carving.solid) == 1


def test_the_widest_handle_comes_first():
    handles = carve(block((MIDDLE, 15, 2), (10, 10, 3), (36, 20, 1)), FRAME, ignore).handles
    centres = [round((handle.center_um[0] - ORIGIN[0]) / PITCH) for handle in handles]
    assert centres == [10, MIDDLE, 36]


def test_the_width_of_a_handle_is_that_of_its_tunnel():
    handles = carve(block((MIDDLE, 15, 2), (10, 10, 3)), FRAME, ignore).handles
    assert [handle.width_um / PITCH for handle in handles] == pytest.approx([7, 5], abs=1.01)


def test_of_two_tunnels_near_the_midline_the_wider_is_the_oesophagus():
    carving = carve(block((MIDDLE - 1, 8, 1), (MIDDLE + 1, 20, 2)), FRAME, ignore)
    assert carving.oesophagus.center_um[1] == pytest.approx(ORIGIN[1] + PITCH * 20, abs=PITCH)
    assert len(carving.handles) == 2


def test_other_tunnels_are_closed_by_thin_membranes():
    carving = carve(block((MIDDLE, 15, 2), (10, 10, 3)), FRAME, ignore)
    closed = np.zeros_like(carving.filled)
    closed[7:14, 7:14, 3:-3] = True
    assert not carving.filled[~closed].any()
    assert 0 < carving.filled.sum() <= 2 * 7 * 7


def test_the_oesophagus_stays_as_wide_as_it_is():
    solid = block((MIDDLE, 15, 2), (10, 10, 3))
    filled = carve(solid, FRAME, ignore).filled
    assert not filled[MIDDLE - 5 : MIDDLE + 6].any()


def hourglass(narrow_layer):
    """A block whose tunnel is 9 wide but for one layer, where it is 3 wide; another is beside it."""
    inside = block((MIDDLE, 15, 4), (9, 10, 2)).inside.copy()
    inside[MIDDLE - 4 : MIDDLE + 5, 11:20, narrow_layer] = True
    inside[MIDDLE - 1 : MIDDLE + 2, 14:17, narrow_layer] = False
    return VoxelSolid(inside, ORIGIN, PITCH)


@pytest.mark.parametrize("layer", [4, 7, 10])
def test_a_tunnel_is_measured_at_its_narrowest_place(layer):
    carving = carve(hourglass(layer), FRAME, ignore)
    assert carving.oesophagus.center_um == pytest.approx(
        ORIGIN + PITCH * np.array([MIDDLE, 15, layer])
    )
    assert carving.oesophagus.width_um == pytest.approx(PITCH * 4, abs=0.01)  # between full voxels


@pytest.mark.parametrize("layer", [4, 7, 10])
def test_the_membrane_spans_the_oesophagus_there(layer):
    membrane = carve(hourglass(layer), FRAME, ignore).membrane
    places = np.round((membrane - ORIGIN) / PITCH).astype(int).tolist()
    assert sorted(places) == [[MIDDLE + x, 15 + y, layer] for x in (-1, 0, 1) for y in (-1, 0, 1)]


def test_a_groove_is_no_tunnel():
    solid = block((MIDDLE, 15, 2))
    inside = solid.inside.copy()
    inside[10:13, :, :7] = False
    carving = carve(VoxelSolid(inside, ORIGIN, PITCH), FRAME, ignore)
    assert len(carving.handles) == 1
    assert np.array_equal(carving.solid.inside, inside)


@pytest.mark.parametrize("tunnels", [(), ((10, 10, 2),)])
def test_a_solid_without_a_tunnel_near_the_midline_has_no_oesophagus(tunnels):
    words = (
        "no tunnel through the main brain passes within 10% of its midline, so the oesophagus "
        "cannot be told; check the trim planes and the resolution"
    )
    with pytest.raises(TopologyError, match=words):
        carve(block(*tunnels), FRAME, ignore)


def test_the_midline_lies_across_the_left_right_axis():
    solid = block((10, 18, 2))  # in the middle of y, at the side of x
    carving = carve(solid, BrainFrame(1, 0, 2), ignore)
    assert carving.oesophagus.center_um[0] == pytest.approx(ORIGIN[0] + PITCH * 10, abs=PITCH)
    with pytest.raises(TopologyError):
        carve(solid, FRAME, ignore)


def test_the_solid_that_was_given_is_not_changed():
    solid = block((MIDDLE, 15, 2), (10, 10, 3))
    carve(solid, FRAME, ignore)
    assert np.array_equal(solid.inside, block((MIDDLE, 15, 2), (10, 10, 3)).inside)


def test_the_inside_is_one_piece_and_so_is_the_outside():
    inside = carve(block((MIDDLE, 15, 2), (10, 10, 3)), FRAME, ignore).solid.inside
    assert ndimage.label(inside, kuhn_structure())[1] == 1
    assert ndimage.label(~inside, kuhn_structure())[1] == 1
