"""The promises of the engine on one real pair of templates, in both directions."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from flyreg_core.boundary import curve_key
from flyreg_core.brain_files import open_brain, read_brain, write_mesh
from flyreg_core.frame import LEFT_RIGHT
from flyreg_core.landmarks import CURVES, HALVES, LandmarkParameters
from flyreg_core.orientation import orientations
from flyreg_core.progress import ignore
from flyreg_core.surface_distance import distances_to_surface, measure_distances, sample_surface
from tests.brains import prepare, register_pair

NAMES = ("FCWB", "JFRC2")
PAIRINGS = ("coordinate", "arc length", "nearest")


@pytest.fixture(scope="module")
def brains():
    return {name: prepare(read_brain(open_brain(name))) for name in NAMES}


@pytest.fixture(scope="module", params=NAMES)
def brain(request, brains):
    return brains[request.param]


@pytest.fixture(scope="module", params=[NAMES, NAMES[::-1]], ids=" to ".join)
def pair(request, brains):
    """Source, target, and the source registered to the target."""
    source, target = (brains[name] for name in request.param)
    return source, target, register_pair(source, target, LandmarkParameters())


def test_a_prepared_brain_written_to_a_file_is_closed_in_one_piece_with_one_handle(brain, tmp_path):
    write_mesh(tmp_path / "brain.ply", brain.torus.surface, "um")
    mesh = trimesh.load(tmp_path / "brain.ply", process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert mesh.euler_number == 0


def lateral(brain, points):
    """How far points lie to the left of the midplane."""
    return brain.torus.frame.coordinates(points)[..., LEFT_RIGHT]


def test_the_handle_is_the_oesophagus_on_the_midline(brain):
    width = np.ptp(lateral(brain, brain.torus.surface.vertices))
    assert abs(lateral(brain, np.array(brain.torus.oesophagus.center_um))) < 0.1 * width
    hole = brain.flat.curves["hole", None].points
    assert abs(lateral(brain, hole).mean()) < 0.1 * width


def test_a_prepared_brain_is_the_original_but_for_half_a_percent_of_its_diagonal(brain):
    surface = brain.torus.surface
    away = distances_to_surface(sample_surface(surface, 20_000), brain.original, ignore)
    x = lateral(brain, sample_surface(surface, 20_000))
    planes = brain.torus.planes
    is_cap = np.minimum(x - planes.right, planes.left - x) < 0.5 * brain.torus.pitch
    assert away[~is_cap].mean() <= 0.005 * surface.diagonal


@pytest.mark.parametrize("half", HALVES)
def test_each_half_has_five_curves_and_four_corners(brain, half):
    curves = {name: brain.flat.curves[curve_key(name, half)].vertices for name in CURVES}
    corners = {int(v) for name in CURVES[:4] for v in curves[name][[0, -1]]}
    assert len(curves) == 5
    assert len(corners) == 4
    assert curves["hole"][0] == curves["hole"][-1]


@pytest.mark.parametrize("half", HALVES)
def test_no_face_is_flipped_by_laying_a_half_flat(brain, half):
    assert (orientations(brain.flat.halves[half].flat.corners) == 1).all()


def test_cutting_leaves_the_surface_where_it_is(brain):
    before, after = brain.torus.surface, brain.surface
    assert after.face_areas.sum() == pytest.approx(before.face_areas.sum())
    assert distances_to_surface(after.vertices, before, ignore).max() < 1e-9 * before.diagonal


def test_no_flat_face_of_the_registered_brain_is_flipped(pair):
    _, _, registration = pair
    assert registration.flipped_on_caps == 0
    for half in registration.halves.values():
        assert (orientations(half.flat.corners) == 1).all()


def test_every_registered_vertex_lies_on_the_target(pair):
    _, target, registration = pair
    away = distances_to_surface(registration.surface.vertices, target.torus.surface, ignore)
    assert away.max() < 1e-9 * target.surface.diagonal


def test_the_registered_brain_written_to_a_file_is_watertight(pair, tmp_path):
    _, _, registration = pair
    write_mesh(tmp_path / "registered.ply", registration.surface, "um")
    mesh = trimesh.load(tmp_path / "registered.ply", process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.euler_number == 0


def test_the_registered_brain_is_within_a_thousandth_of_the_diagonal_of_the_target(pair):
    _, target, registration = pair
    distances = measure_distances(registration.surface, target.torus.surface, ignore)
    for summary in (distances.a_to_b, distances.b_to_a):
        assert summary.mean_um <= 0.001 * distances.diagonal_um
        assert summary.hausdorff_um <= 0.03 * distances.diagonal_um


@pytest.mark.parametrize("pairing", PAIRINGS)
def test_a_brain_registered_to_itself_stays_where_it_is(brain, pairing):
    registration = register_pair(brain, brain, LandmarkParameters(pairing=pairing))
    away = np.abs(registration.surface.vertices - brain.surface.vertices).max(axis=1)
    # a few vertices lie 1e-12 from a boundary of the strip, where rounding is a share of that
    assert np.quantile(away, 0.999) < 1e-9 * brain.surface.diagonal
    assert away.max() < 1e-6 * brain.surface.diagonal


@pytest.mark.parametrize("pairing", PAIRINGS[1:])
def test_other_ways_of_pairing_flip_nothing_either(brains, pairing):
    source, target = (brains[name] for name in NAMES)
    registration = register_pair(source, target, LandmarkParameters(pairing=pairing))
    assert registration.flipped_on_caps == 0
    for half in registration.halves.values():
        assert (orientations(half.flat.corners) == 1).all()


def test_the_same_brain_is_prepared_and_registered_to_the_same_bytes(brains):
    source, target = (brains[name] for name in NAMES)
    again = prepare(read_brain(open_brain(NAMES[0])))
    assert np.array_equal(again.surface.vertices, source.surface.vertices)
    assert np.array_equal(again.surface.faces, source.surface.faces)
    one, other = (register_pair(b, target, LandmarkParameters()) for b in (source, again))
    assert np.array_equal(one.surface.vertices, other.surface.vertices)
    assert one.residual_um == other.residual_um
