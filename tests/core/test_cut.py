from dataclasses import replace

import numpy as np
import pytest
import trimesh

from flyreg_core.cut import PIECES, CutParameters, dissect
from flyreg_core.errors import TopologyError
from flyreg_core.progress import ignore
from flyreg_core.surface_distance import distances_to_surface
from flyreg_core.topology import (
    boundary_loops,
    compacted,
    component_of_vertex,
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
    z = demo.surface.vertices[:, 2]
    front, back = (demo.flat.dissection.faces_of(half) for half in ("anterior", "posterior"))
    assert z[front].mean() < z[back].mean() - 0.2 * np.ptp(z)


def test_the_caps_lie_on_their_trim_planes(demo: PreparedBrain):
    torus, dissection = demo.torus, demo.flat.dissection
    for side in ("right", "left"):
        x = demo.surface.vertices[dissection.faces_of(f"{side} cap"), 0]
        assert x == pytest.approx(getattr(torus.planes, side), abs=torus.pitch)


def test_the_cut_passes_the_middle_of_the_oesophagus(demo: PreparedBrain):
    knots = demo.flat.dissection.cut_knots
    assert knots[1, 0] == pytest.approx(
        demo.torus.oesophagus.center_um[0], abs=3 * demo.torus.pitch
    )
    assert (np.diff(knots[:, 0]) > 0).all()


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


def test_a_trim_plane_beside_the_brain_is_told(demo_source: PreparedBrain):
    torus = demo_source.torus
    for side, beyond in (("right", -1000.0), ("left", 1000.0)):
        planes = replace(torus.planes, **{side: beyond})
        words = f"the {side} trim plane does not touch the brain; move it inwards"
        with pytest.raises(TopologyError, match=words):
            dissect(
                replace(torus, planes=planes), torus.surface, demo_source.smoothed, CutParameters()
            )


@pytest.mark.parametrize("shift_um", [-10_000.0, 10_000.0])
def test_a_cut_beside_the_brain_is_told(demo_source: PreparedBrain, shift_um):
    words = "the cut leaves nothing on one side of it; move the cut height back"
    with pytest.raises(TopologyError, match=words):
        shifted(demo_source, shift_um)


def test_a_cut_that_misses_the_oesophagus_is_told_with_what_came_of_it(demo_source: PreparedBrain):
    z = demo_source.smoothed[:, 2]
    beyond = z.min() - demo_source.flat.dissection.cut_knots[1, 1] + 0.1 * np.ptp(z)
    words = (
        r"the (anterior|posterior) is not a ring \(Euler characteristic -?\d+, not 0\): the cut "
        "does not run once through the oesophagus and both trim openings; move the cut height or "
        "the trim planes"
    )
    with pytest.raises(TopologyError, match=words):
        shifted(demo_source, beyond)


def test_the_same_torus_is_cut_to_the_same_bytes(demo: PreparedBrain):
    again = shifted(demo, 0.0)
    assert again.surface.vertices.tobytes() == demo.surface.vertices.tobytes()
    assert again.surface.faces.tobytes() == demo.surface.faces.tobytes()
    assert np.array_equal(again.piece_of_face, demo.flat.dissection.piece_of_face)
