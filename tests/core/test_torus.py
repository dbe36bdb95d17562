import itertools

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core import torus as torus_module
from flyreg_core.errors import Cancelled, TopologyError
from flyreg_core.frame import LEFT_RIGHT
from flyreg_core.handles import HandleParameters
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.pockets import DEPTH
from flyreg_core.progress import ignore
from flyreg_core.solid import SolidParameters, voxelize
from flyreg_core.topology import component_of_vertex, unique_edges
from flyreg_core.torus import LEAST_UPRIGHT, ORIGINS, ROUNDS, make_torus
from flyreg_core.trim import TrimParameters
from tests import shapes
from tests.brains import PreparedBrain
from tests.frames import UPRIGHT
from tests.shapes import box, inside_out, together

AUTOMATIC = HandleParameters()
THROUGH = HandleParameters(drills=(((0.0, 0.0, -50.0), (0.0, 0.0, 50.0)),))
SIZE = np.array([400.0, 200.0, 100.0])
TUNNEL = 50.0


def block_with_tunnels(*centres, width=TUNNEL):
    """A block with square tunnels along z, as the surface between cells of a coarse grid."""
    x_cuts = sorted({-200.0, 200.0, *(c + s * width / 2 for c, _ in centres for s in (-1, 1))})
    y_cuts = sorted({-100.0, 100.0, *(c + s * width / 2 for _, c in centres for s in (-1, 1))})
    x_middles, y_middles = (np.add(cuts[1:], cuts[:-1]) / 2 for cuts in (x_cuts, y_cuts))

    def is_full(i, j):
        if not (0 <= i < len(x_middles) and 0 <= j < len(y_middles)):
            return False
        return all(
            max(abs(x_middles[i] - x), abs(y_middles[j] - y)) > width / 2 for x, y in centres
        )

    corners = []
    for i in range(len(x_middles)):
        for j in range(len(y_middles)):
            if not is_full(i, j):
                continue
            (x0, x1), (y0, y1) = x_cuts[i : i + 2], y_cuts[j : j + 2]
            around = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
            corners.append([(x, y, 50.0) for x, y in around])
            corners.append([(x, y, -50.0) for x, y in around[::-1]])
            for k, (di, dj) in enumerate(((0, -1), (1, 0), (0, 1), (-1, 0))):
                if not is_full(i + di, j + dj):
                    (a, b), (c, d) = around[k], around[(k + 1) % 4]
                    corners.append([(a, b, -50.0), (c, d, -50.0), (c, d, 50.0), (a, b, 50.0)])
    vertices = np.array(corners).reshape(-1, 3)
    start = 4 * np.arange(len(corners))[:, None]
    return SurfaceMesh(vertices, np.vstack([np.add(start, [0, 1, 2]), np.add(start, [0, 2, 3])]))


def made(original, right=-150.0, left=150.0, across=27, handles=AUTOMATIC, frame=UPRIGHT):
    solid = voxelize(original, frame, SolidParameters(across), ignore)
    return make_torus(original, solid, TrimParameters(right, left), handles, ignore)


def with_part(mesh, part):
    return SurfaceMesh(*together((mesh.vertices, mesh.faces), part))


def of_origin(torus, name):
    """The vertices of one origin, in the frame of the animal."""
    chosen = torus.origin_of_vertex == ORIGINS.index(name)
    return torus.frame.coordinates(torus.surface.vertices[chosen])


def as_trimesh(surface):
    return trimesh.Trimesh(surface.vertices, surface.faces, process=False)


def assert_torus(surface):
    mesh = as_trimesh(surface)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert mesh.euler_number == 0
    assert mesh.volume > 0


def test_the_main_brain_is_closed_in_one_piece_with_one_handle(demo: PreparedBrain):
    assert_torus(demo.torus.surface)


def test_the_handle_is_near_the_midline(demo: PreparedBrain):
    x, center = (
        demo.torus.frame.coordinates(places)[..., LEFT_RIGHT]
        for places in (demo.torus.surface.vertices, np.array(demo.torus.oesophagus.center_um))
    )
    middle, width = (x.min() + x.max()) / 2, np.ptp(x)
    assert abs(center - middle) < 0.1 * width
    assert demo.torus.oesophagus in demo.torus.handles


def test_nothing_reaches_beyond_the_trim_planes(demo: PreparedBrain):
    torus = demo.torus
    x = torus.frame.coordinates(torus.surface.vertices)[:, LEFT_RIGHT]
    assert x.min() >= torus.planes.right - torus.pitch
    assert x.max() <= torus.planes.left + torus.pitch


def test_a_block_with_a_tunnel_has_the_volume_of_a_block_with_a_tunnel():
    torus = made(block_with_tunnels((0, 0)))
    assert_torus(torus.surface)
    expected = 300 * SIZE[1] * SIZE[2] - TUNNEL**2 * SIZE[2]
    assert torus.surface.volume == pytest.approx(expected, rel=0.02)
    assert torus.filled_um3 == 0
    assert torus.oesophagus.center_um == pytest.approx((0, 0, 0), abs=50 + 2 * torus.pitch)
    assert torus.oesophagus.width_um == pytest.approx(TUNNEL, abs=2 * torus.pitch)


@pytest.mark.parametrize("voxels", [2, 3])
def test_an_oesophagus_no_wider_than_a_crack_stays_open(voxels):
    width = voxels * SIZE[1] / 27
    torus = made(block_with_tunnels((0, 0), width=width))
    assert_torus(torus.surface)
    assert torus.oesophagus.width_um == pytest.approx(width, abs=2 * torus.pitch)


def test_flat_faces_are_drawn_flat():
    surface = made(block_with_tunnels((0, 0))).surface
    top = surface.vertices[surface.vertices[:, 2] > 40]
    inner = (np.abs(top[:, 0]) < 130) & (np.abs(top[:, 1]) < 80)
    inner &= np.abs(top[:, :2]).max(axis=1) > 35
    assert top[inner, 2] == pytest.approx(50.0, abs=1e-6)


def test_other_tunnels_are_filled_and_their_volume_is_told():
    torus = made(block_with_tunnels((0, 0), (100, 0)))
    assert_torus(torus.surface)
    assert len(torus.handles) == 2
    assert 0.5 < torus.filled_um3 / (TUNNEL**2 * torus.pitch) < most_layers(torus)


def most_layers(torus):
    """How many layers of voxels fill a tunnel but for its ends, which show."""
    return SIZE[2] / torus.pitch - 2 * DEPTH


def test_the_planes_are_where_the_parameters_put_them():
    torus = made(block_with_tunnels((0, 0)), right=-120.0, left=140.0)
    assert (torus.planes.right, torus.planes.left) == (-120, 140)
    x = torus.surface.vertices[:, 0]
    assert (x.min(), x.max()) == pytest.approx((-120, 140), abs=0.5 * torus.pitch)


@pytest.fixture(scope="module")
def a_block():
    """A block with two tunnels, of which one is filled."""
    return made(block_with_tunnels((0, 0), (100, 0)))


def test_vertices_that_come_from_the_original_lie_on_it(demo: PreparedBrain, a_block):
    for torus, original in (
        (demo.torus, demo.original),
        (a_block, block_with_tunnels((0, 0), (100, 0))),
    ):
        places = torus.surface.vertices[torus.origin_of_vertex == ORIGINS.index("original")]
        assert len(places) > 0.8 * len(torus.surface.vertices)
        _, away, _ = trimesh.proximity.closest_point(as_trimesh(original), places)
        assert away.mean() < 1e-3 * torus.pitch


def test_vertices_on_the_trim_planes_are_those_that_were_trimmed(a_block):
    trimmed = of_origin(a_block, "trimmed")
    assert np.abs(np.abs(trimmed[:, 0]) - 150).max() <= a_block.pitch
    x, y, z = a_block.surface.vertices.T
    on_plane = (np.abs(x) > 149.9) & (np.abs(y) < 90) & (np.abs(z) < 40)
    assert on_plane.any()
    assert (a_block.origin_of_vertex[on_plane] == ORIGINS.index("trimmed")).all()
    others = a_block.origin_of_vertex != ORIGINS.index("trimmed")
    assert np.abs(x[others]).max() < 150


def test_vertices_across_a_filled_tunnel_are_those_that_were_filled(a_block):
    filled = of_origin(a_block, "filled")
    tunnel = np.abs(filled[:, :2] - [100, 0]).max(axis=1)
    assert tunnel.max() <= TUNNEL / 2 + a_block.pitch
    assert np.abs(filled[:, 2]).max() < 50
    x, y, _ = a_block.surface.vertices.T
    across = np.maximum(np.abs(x - 100), np.abs(y)) < TUNNEL / 2 - a_block.pitch
    assert across.any()
    assert (a_block.origin_of_vertex[across] == ORIGINS.index("filled")).all()


def test_vertices_of_a_drilled_channel_are_those_that_were_drilled():
    torus = made(block_with_tunnels(), handles=THROUGH)
    assert_torus(torus.surface)
    away = np.hypot(*of_origin(torus, "drilled")[:, :2].T) / torus.pitch
    assert away.min() > 0.5
    assert away.max() < 3
    x, y, z = torus.surface.vertices.T
    in_channel = (np.hypot(x, y) < 3 * torus.pitch) & (np.abs(z) < 50 - torus.pitch)
    assert in_channel.any()
    assert (torus.origin_of_vertex[in_channel] == ORIGINS.index("drilled")).all()
    assert torus.chosen_by == "drilled by the user"
    assert torus.drilled_um3 == pytest.approx(
        np.pi * (1.5 * torus.pitch) ** 2 * 100, rel=0.3
    )  # 9 voxels stand for a disk of radius 1.5
    assert torus.filled_um3 == 0


def test_vertices_over_a_hole_in_the_original_are_bridged():
    whole = block_with_tunnels((0, 0))
    middles = whole.vertices[whole.faces].mean(axis=1)
    is_gone = (middles[:, 2] > 49) & (middles[:, 0] < -25) & (middles[:, 1] < -25)
    torus = made(SurfaceMesh(whole.vertices, whole.faces[~is_gone]))
    assert_torus(torus.surface)
    bridged = of_origin(torus, "bridged")
    assert (bridged[:, :2].max(axis=0) < -25 + 2 * torus.pitch).all()
    x, y, z = torus.surface.vertices.T
    over = (np.abs(x + 90) < 40) & (np.abs(y + 62) < 20) & (z > 0)
    assert over.any()
    assert (torus.origin_of_vertex[over] == ORIGINS.index("bridged")).all()


def test_a_whole_original_is_nowhere_bridged(demo: PreparedBrain, a_block):
    assert len(of_origin(demo.torus, "bridged")) == 0
    assert len(of_origin(a_block, "bridged")) == 0


def test_faces_away_from_the_edges_of_a_block_look_where_its_faces_do(a_block):
    surface = a_block.surface
    corners = surface.vertices[surface.faces]
    is_original = (a_block.origin_of_vertex[surface.faces] == 0).all(axis=1)
    normal = surface.face_normals / (2 * surface.face_areas[:, None])
    for axis, half in ((1, 100.0), (2, 50.0)):
        for side in (-1, 1):
            on_face = is_original & (np.abs(corners[..., axis] - side * half) < 1e-6).all(axis=1)
            assert on_face.sum() > 100
            assert normal[on_face, axis] == pytest.approx(side)


def test_no_step_back_to_the_original_turns_a_face_far(monkeypatch, demo_source: PreparedBrain):
    surfaces = []
    for rounds in range(ROUNDS + 1):
        monkeypatch.setattr(torus_module, "ROUNDS", rounds)
        made_of = demo_source.original, demo_source.solid, TrimParameters(), AUTOMATIC
        surfaces.append(make_torus(*made_of, ignore).surface)
    away = [np.abs(surface.vertices - surfaces[-1].vertices).max() for surface in surfaces]
    assert away[0] > 0.01 * demo_source.torus.pitch
    for before, after in itertools.pairwise(surfaces):
        along = (before.face_normals * after.face_normals).sum(axis=1)
        size = 4 * before.face_areas * after.face_areas
        assert (along >= LEAST_UPRIGHT * size * (1 - 1e-9)).all()
    assert np.array_equal(surfaces[-1].vertices, demo_source.torus.surface.vertices)


def test_each_filled_tunnel_is_told_with_its_place_and_volume():
    torus = made(block_with_tunnels((0, 0), (100, 0), (-100, 40)))
    assert len(torus.fillings) == 2
    places = sorted(filling.center_um[:2] for filling in torus.fillings)
    assert np.abs(np.subtract(places, [(-100, 40), (100, 0)])).max() < 2 * torus.pitch
    for filling in torus.fillings:
        sheets = filling.volume_um3 / (TUNNEL**2 * torus.pitch)
        assert 0.5 < sheets < most_layers(torus)
    assert sum(filling.volume_um3 for filling in torus.fillings) == torus.filled_um3


def test_a_filled_cavity_is_told_with_its_place_and_volume_and_the_largest_comes_first():
    edges = (60.0, 60.0, 50.0), (30.0, 45.0, 40.0)
    centers = (90.0, 10.0, 0.0), (-100.0, -20.0, 5.0)
    original = block_with_tunnels((0, 0))
    for size, center in zip(edges, centers, strict=True):
        original = with_part(original, inside_out(box(size, center)))
    torus = made(original)
    assert_torus(torus.surface)
    assert len(torus.fillings) == 2
    for filling, size, center in zip(torus.fillings, edges, centers, strict=True):
        assert filling.center_um == pytest.approx(center, abs=torus.pitch)
        assert filling.volume_um3 == pytest.approx(np.prod(size), rel=0.4)
    whole = made(block_with_tunnels((0, 0))).surface.volume
    assert torus.surface.volume == pytest.approx(whole, rel=1e-6)


def test_a_solid_that_is_thin_in_the_middle_is_drilled_there_as_a_guess():
    thin = with_part(block_with_tunnels((0, 0)), box((60.0, 60.0, 12.0), (0, 0, 40)))
    torus = made(thin)
    assert_torus(torus.surface)
    assert torus.is_guess
    assert torus.oesophagus.center_um[:2] == pytest.approx((0, 0), abs=TUNNEL / 2)
    assert len(of_origin(torus, "drilled")) > 0
    (warning,) = torus.warnings
    assert warning.startswith("the oesophagus is a guess: the tunnel at (")
    assert "um wide, drilled through the thinnest place of the midline; point at the" in warning


def test_a_solid_without_a_tunnel_or_a_thin_place_has_no_oesophagus():
    with pytest.raises(TopologyError, match="the main brain has no tunnel, so there is no oeso"):
        made(block_with_tunnels())


def test_a_choice_that_is_no_guess_has_no_warning(a_block):
    assert a_block.warnings == ()


def between(turn, start):
    """The half turn from `start` on."""
    return (turn - start) % 1.0 < 0.5


def part(faces, chosen):
    """Euler characteristic and number of components of all that lies between chosen vertices."""
    edges, _ = unique_edges(faces)
    inner_edges, inner_faces = edges[chosen[edges].all(axis=1)], faces[chosen[faces].all(axis=1)]
    component = component_of_vertex(faces, len(chosen), chosen)[chosen]
    characteristic = int(chosen.sum()) - len(inner_edges) + len(inner_faces)
    return characteristic, len(np.unique(component))


@pytest.fixture(scope="module", params=["source", "target", "block", "ring"])
def any_torus(request, a_block):
    """Two brains, a block with a square tunnel, and a true ring."""
    if request.param == "block":
        return a_block
    if request.param == "ring":
        return made(SurfaceMesh(*shapes.torus()), -300.0, 300.0, across=40)
    return request.getfixturevalue(f"demo_{request.param}").torus


@given(start=st.floats(0, 1, exclude_max=True))
@settings(max_examples=25)
def test_any_half_turn_around_the_oesophagus_is_a_ring_and_so_is_the_rest(any_torus, start):
    chosen = between(any_torus.turn, start)
    assert part(any_torus.surface.faces, chosen) == (0, 1)
    assert part(any_torus.surface.faces, ~chosen) == (0, 1)


def test_turns_are_shares_of_one_turn(any_torus):
    assert any_torus.turn.min() >= 0
    assert any_torus.turn.max() < 1


def test_the_turn_is_harmonic(any_torus):
    edges, _ = unique_edges(any_torus.surface.faces)
    step = (np.diff(any_torus.turn[edges], axis=1)[:, 0] + 0.5) % 1.0 - 0.5  # the shorter way
    n = len(any_torus.turn)
    sum_of_steps = np.bincount(edges[:, 0], step, n) - np.bincount(edges[:, 1], step, n)
    assert np.abs(sum_of_steps).max() < 1e-9


def test_around_a_ring_the_turn_grows_from_the_hole_over_the_back_to_the_outside_and_the_front():
    torus = made(SurfaceMesh(*shapes.torus(200.0, 80.0)), -300.0, 300.0, across=40)
    x, y, z = torus.surface.vertices.T
    angle = np.arctan2(z, 200.0 - np.hypot(x, y)) / (2 * np.pi) % 1.0  # 0 in the hole, 1/4 behind
    pointer = np.exp(2j * np.pi * torus.turn)
    mean = np.array([np.angle(pointer[angle // 0.125 == k].mean()) for k in range(8)]) / (2 * np.pi)
    steps = (np.roll(mean, -1) - mean) % 1.0
    assert steps.max() < 0.5
    assert steps.sum() == pytest.approx(1.0)
    assert torus.turn[(np.abs(angle - 0.5) < 0.02)].mean() == pytest.approx(0.5, abs=0.1)


def test_the_same_brain_gives_the_same_surface_however_it_lies_in_its_file(
    demo_source: PreparedBrain, demo_elsewhere: PreparedBrain
):
    here, there = demo_source.torus, demo_elsewhere.torus
    own, other = (torus.frame.coordinates(torus.surface.vertices) for torus in (here, there))
    assert np.array_equal(there.surface.faces, here.surface.faces)
    rounding = 1e-9 * here.surface.diagonal
    assert np.abs(other - own).max() < rounding
    assert np.array_equal(there.origin_of_vertex, here.origin_of_vertex)
    assert there.turn == pytest.approx(here.turn, abs=1e-9)
    own, other = (torus.frame.coordinates(torus.membrane) for torus in (here, there))
    assert np.abs(other - own).max() < rounding
    for one, same in zip(here.handles, there.handles, strict=True):
        center = there.frame.coordinates(np.array(same.center_um))
        assert center == pytest.approx(here.frame.coordinates(np.array(one.center_um)))
        assert same.is_oesophagus == one.is_oesophagus


def test_drawing_can_be_cancelled():
    original = block_with_tunnels((0, 0))
    solid = voxelize(original, UPRIGHT, SolidParameters(27), ignore)

    def report(fraction, text):
        if fraction > 0.5:
            raise Cancelled

    with pytest.raises(Cancelled):
        make_torus(original, solid, TrimParameters(), AUTOMATIC, report)


def test_the_same_solid_gives_the_same_bytes(demo_source: PreparedBrain):
    original, solid = demo_source.original, demo_source.solid
    again = make_torus(original, solid, TrimParameters(), AUTOMATIC, ignore).surface
    assert np.array_equal(again.vertices, demo_source.torus.surface.vertices)
    assert np.array_equal(again.faces, demo_source.torus.surface.faces)
