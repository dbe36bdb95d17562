import contextlib
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from flyreg_core.boundary import find_curves
from flyreg_core.cut import PIECES, dissect
from flyreg_core.cut_height import CutParameters
from flyreg_core.errors import TopologyError
from flyreg_core.frame import ANTERO_POSTERIOR, DORSO_VENTRAL, LEFT_RIGHT
from flyreg_core.landmarks import HALVES
from flyreg_core.orientation import orientations
from flyreg_core.progress import ignore
from flyreg_core.simplify import SimplifyParameters, simplify
from flyreg_core.smooth import SmoothParameters, smooth
from flyreg_core.surface_distance import distances_to_surface
from flyreg_core.topology import (
    boundary_loops,
    compacted,
    component_of_vertex,
    euler_characteristic,
    is_closed,
    unique_edges,
)
from tests.brains import PreparedBrain

SHAPES = {"anterior": (0, 2), "posterior": (0, 2), "right cap": (1, 1), "left cap": (1, 1)}


def shifted(brain, shift_um):
    return dissect(brain.torus, brain.torus.surface, brain.smoothed, CutParameters(shift_um))


@pytest.mark.parametrize("piece", PIECES)
def test_halves_are_rings_and_caps_are_disks(demo: PreparedBrain, piece):
    faces, _ = compacted(demo.flat.dissection.faces_of(piece))
    characteristic, loops = SHAPES[piece]
    mesh = trimesh.Trimesh(np.zeros((faces.max() + 1, 3)), faces, process=False)
    assert mesh.euler_number == characteristic
    assert len(boundary_loops(faces)) == loops
    assert len(set(component_of_vertex(faces).tolist())) == 1


def test_each_face_belongs_to_exactly_one_piece(demo: PreparedBrain):
    counts = [len(demo.flat.dissection.faces_of(piece)) for piece in PIECES]
    assert sum(counts) == len(demo.surface.faces)
    assert min(counts) > 0


def test_cutting_leaves_the_surface_where_it_is(demo: PreparedBrain):
    before, after = demo.torus.surface, demo.surface
    assert np.array_equal(after.vertices[: len(before.vertices)], before.vertices)
    assert after.face_areas.sum() == pytest.approx(before.face_areas.sum())
    assert after.volume == pytest.approx(before.volume)
    new = after.vertices[len(before.vertices) :]
    assert distances_to_surface(new, before, ignore).max() < 1e-9 * before.diagonal
    middles = after.vertices[after.faces].mean(axis=1)
    assert distances_to_surface(middles, before, ignore).max() < 1e-9 * before.diagonal


def test_cutting_keeps_the_surface_closed_with_one_handle(demo: PreparedBrain):
    assert is_closed(demo.surface.faces)
    mesh = trimesh.Trimesh(demo.surface.vertices, demo.surface.faces, process=False)
    assert mesh.is_watertight
    assert mesh.euler_number == 0
    assert demo.surface.face_areas.min() > 0


@pytest.mark.parametrize("piece", PIECES)
def test_no_edge_crosses_a_piece_from_boundary_to_boundary(demo: PreparedBrain, piece):
    edges, counts = unique_edges(demo.flat.dissection.faces_of(piece))
    on_boundary = set(edges[counts == 1].ravel().tolist())
    inner = edges[counts == 2].tolist()
    assert not [edge for edge in inner if set(edge) <= on_boundary]


def test_the_anterior_half_lies_before_the_posterior_one(demo: PreparedBrain):
    z = demo.torus.frame.coordinates(demo.surface.vertices)[:, ANTERO_POSTERIOR]
    front, back = (demo.flat.dissection.faces_of(half) for half in ("anterior", "posterior"))
    assert z[front].mean() < z[back].mean() - 0.2 * np.ptp(z)


def test_the_caps_lie_on_their_trim_planes(demo: PreparedBrain):
    torus, dissection = demo.torus, demo.flat.dissection
    x = torus.frame.coordinates(demo.surface.vertices)[:, LEFT_RIGHT]
    for side in ("right", "left"):
        on_cap = x[dissection.faces_of(f"{side} cap")]
        assert on_cap == pytest.approx(getattr(torus.planes, side), abs=torus.pitch)


def test_the_cut_passes_the_middle_of_the_oesophagus(demo: PreparedBrain):
    knots, torus = demo.flat.dissection.cut_knots, demo.torus
    center = torus.frame.coordinates(np.array(torus.oesophagus.center_um))
    assert knots[1, 0] == pytest.approx(center[LEFT_RIGHT], abs=3 * torus.pitch)
    assert (np.diff(knots[:, 0]) > 0).all()


def test_the_hole_of_both_halves_is_one_curve_around_the_oesophagus(demo: PreparedBrain):
    hole = demo.torus.frame.coordinates(demo.flat.curves["hole", None].points)
    membrane = demo.torus.frame.coordinates(demo.torus.membrane)
    across = [LEFT_RIGHT, DORSO_VENTRAL]
    arm = (hole - membrane.mean(axis=0))[:, across] @ [1, 1j]
    turns = np.angle(arm[1:] / arm[:-1]).sum() / (2 * np.pi)
    assert abs(turns) == pytest.approx(1)
    reach = 0.5 * demo.torus.oesophagus.width_um + 3 * demo.torus.pitch
    assert cKDTree(membrane).query(hole)[0].max() < reach


def test_shifting_the_cut_moves_it_by_as_much(demo_source: PreparedBrain):
    moved = shifted(demo_source, 3.0)
    away = moved.cut_knots - demo_source.flat.dissection.cut_knots
    assert away == pytest.approx(np.array([[0.0, 3.0]] * 3))


def test_shifting_the_cut_back_enlarges_the_anterior_half(demo_source: PreparedBrain):
    area = []
    for shift_um in (-3.0, 0.0, 3.0):
        dissection = shifted(demo_source, shift_um)
        faces = dissection.piece_of_face == PIECES.index("anterior")
        area.append(dissection.surface.face_areas[faces].sum())
    assert area[0] < area[1] < area[2]


def test_shifting_the_cut_back_lays_the_outer_seams_further_back(demo_source: PreparedBrain):
    frame = demo_source.torus.frame
    depth = []
    for shift_um in (-5.0, 0.0, 5.0):
        curves = find_curves(shifted(demo_source, shift_um), frame)
        seams = np.concatenate([curves[name, None].points for name in ("upper", "lower")])
        depth.append(frame.coordinates(seams)[:, ANTERO_POSTERIOR].mean())
    assert depth[0] < depth[1] < depth[2]


ANY_SHIFT = st.one_of(st.floats(-15, 15), st.floats(-80, 80), st.floats(-10_000, 10_000))
MISSED = "the cut does not pass the (right|left) trim opening; move the cut height or the plane"


@given(shift_um=ANY_SHIFT)
@settings(max_examples=10)
def test_with_any_shift_halves_are_rings_and_caps_disks_or_a_missed_trim_opening_is_told(
    demo: PreparedBrain, shift_um
):
    dissection = None
    with contextlib.suppress(TopologyError):
        dissection = shifted(demo, shift_um)
    if dissection is None:
        with pytest.raises(TopologyError, match=MISSED):
            shifted(demo, shift_um)
        return
    for piece, (characteristic, loops) in SHAPES.items():
        faces, _ = compacted(dissection.faces_of(piece))
        assert euler_characteristic(faces) == characteristic
        assert len(boundary_loops(faces)) == loops
        assert len(set(component_of_vertex(faces).tolist())) == 1
    assert len(find_curves(dissection, demo.torus.frame)) == 7


def test_a_cut_that_misses_a_trim_opening_is_told(demo_target: PreparedBrain):
    with pytest.raises(TopologyError, match=MISSED):
        shifted(demo_target, -40.0)


@given(amount=st.floats(-1, 1), seed=st.integers(0, 2**32 - 1))
@settings(max_examples=5)
def test_whatever_the_smoothed_surface_looks_like_the_pieces_are_rings_and_disks(
    demo_source: PreparedBrain, amount, seed
):
    noise = np.random.default_rng(seed).normal(size=demo_source.smoothed.shape)
    smoothed = demo_source.smoothed + 2 * amount * demo_source.torus.pitch * noise
    surface = demo_source.torus.surface
    dissection = dissect(demo_source.torus, surface, smoothed, CutParameters())
    found = [euler_characteristic(dissection.faces_of(piece)) for piece in PIECES]
    assert found == [SHAPES[piece][0] for piece in PIECES]


def test_a_simplified_surface_is_cut_into_rings_and_disks_too(demo: PreparedBrain):
    coarse = simplify(demo.torus.surface, SimplifyParameters(6000), ignore).surface
    smoothed = smooth(coarse.vertices, coarse.faces, SmoothParameters(), ignore)
    dissection = dissect(demo.torus, coarse, smoothed, CutParameters())
    found = [euler_characteristic(dissection.faces_of(piece)) for piece in PIECES]
    assert found == [SHAPES[piece][0] for piece in PIECES]
    assert is_closed(dissection.surface.faces)


def test_a_brain_is_cut_alike_however_it_lies_in_its_file(
    demo_source: PreparedBrain, demo_elsewhere: PreparedBrain
):
    here, there = demo_source.flat.dissection, demo_elsewhere.flat.dissection
    assert np.array_equal(there.surface.faces, here.surface.faces)
    assert np.array_equal(there.piece_of_face, here.piece_of_face)
    assert there.cut_knots == pytest.approx(here.cut_knots)
    own, other = (
        brain.torus.frame.coordinates(brain.surface.vertices)
        for brain in (demo_source, demo_elsewhere)
    )
    assert np.abs(other - own).max() < 1e-9 * here.surface.diagonal


def test_a_brain_is_laid_flat_alike_however_it_lies_in_its_file(
    demo_source: PreparedBrain, demo_elsewhere: PreparedBrain
):
    for key, curve in demo_source.flat.curves.items():
        assert np.array_equal(demo_elsewhere.flat.curves[key].vertices, curve.vertices)
    for half in HALVES:
        here, there = demo_source.flat.halves[half], demo_elsewhere.flat.halves[half]
        assert there.plane == pytest.approx(here.plane, abs=1e-6)
        assert (orientations(there.flat.corners) == 1).all()


def test_a_trim_plane_beside_the_brain_is_told(demo_source: PreparedBrain):
    torus = demo_source.torus
    for side, beyond in (("right", -1000.0), ("left", 1000.0)):
        planes = replace(torus.planes, **{side: beyond})
        words = f"the {side} trim plane does not touch the brain; move it inwards"
        with pytest.raises(TopologyError, match=words):
            dissect(
                replace(torus, planes=planes), torus.surface, demo_source.smoothed, CutParameters()
            )


def test_the_same_torus_is_cut_to_the_same_bytes(demo: PreparedBrain):
    again = shifted(demo, 0.0)
    assert np.array_equal(again.surface.vertices, demo.surface.vertices)
    assert np.array_equal(again.surface.faces, demo.surface.faces)
    assert np.array_equal(again.piece_of_face, demo.flat.dissection.piece_of_face)
