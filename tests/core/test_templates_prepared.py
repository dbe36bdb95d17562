"""Every template becomes two rings and two disks that lie flat without a fold, near the original.

Each is prepared once, as the program does it, and given up before the next.
"""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from flyreg_core.boundary import curve_key
from flyreg_core.brain_files import open_brain
from flyreg_core.cut import PIECES
from flyreg_core.flatten import mean_matrix
from flyreg_core.handles import HandleParameters
from flyreg_core.landmarks import CURVES, HALVES
from flyreg_core.orientation import orientations
from flyreg_core.pipeline import Pipeline
from flyreg_core.progress import ignore
from flyreg_core.project import Brain
from flyreg_core.results import PreparedBrain
from flyreg_core.surface_distance import distances_to_surface
from flyreg_core.topology import boundary_loops, compacted
from flyreg_core.torus import ORIGINS

TEMPLATES = (
    *("FCWB", "JFRC2", "IS2", "T1", "IBNWB", "JFRC2013", "JFRC2013DS"),
    *("JRC2018F", "JRC2018M", "JRC2018U", "Dmel", "DsecI", "Dsim", "Dvir"),
    *("FAFB14", "FLYWIRE", "FLYWIRE_whole_brain", "JRCFIB2022M_brain", "BANC_brain", "AEDES"),
)
CLICKS: dict[str, HandleParameters] = {}
"""What a user has to point at, or to drill, in the few templates that do not do by themselves."""
SHAPES = {"anterior": (0, 2), "posterior": (0, 2), "right cap": (1, 1), "left cap": (1, 1)}
"""Euler characteristic and number of boundaries: rings and disks."""


@pytest.fixture(scope="module", params=TEMPLATES)
def prepared(request: pytest.FixtureRequest) -> PreparedBrain:
    """One template after the other."""
    clicks = CLICKS.get(request.param, HandleParameters())
    return Pipeline().prepare(Brain(open_brain(request.param), handles=clicks))


def as_trimesh(faces, n_vertices) -> trimesh.Trimesh:
    return trimesh.Trimesh(np.zeros((n_vertices, 3)), faces, process=False)


def test_the_main_brain_is_closed_in_one_piece_with_one_handle(prepared: PreparedBrain):
    surface = prepared.torus.surface
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert mesh.euler_number == 0  # genus 1
    assert mesh.volume > 0


@pytest.mark.parametrize("piece", PIECES)
def test_halves_are_rings_and_caps_are_disks(prepared: PreparedBrain, piece):
    faces, _ = compacted(prepared.flat.dissection.faces_of(piece))
    mesh = as_trimesh(faces, int(faces.max()) + 1)
    assert (mesh.euler_number, len(boundary_loops(faces))) == SHAPES[piece]
    assert len(trimesh.graph.connected_components(mesh.edges_unique)) == 1


@pytest.mark.parametrize("half", HALVES)
def test_each_half_has_five_curves_and_four_corners(prepared: PreparedBrain, half):
    curves = {name: prepared.flat.curves[curve_key(name, half)].vertices for name in CURVES}
    assert len(curves) == 5
    assert len({int(vertex) for name in CURVES[:4] for vertex in curves[name][[0, -1]]}) == 4
    assert curves["hole"][0] == curves["hole"][-1]
    faces = prepared.flat.dissection.faces_of(half)
    on_boundary = {int(vertex) for loop in boundary_loops(faces) for vertex in loop}
    assert {int(vertex) for curve in curves.values() for vertex in curve} == on_boundary


@pytest.mark.parametrize("half", HALVES)
def test_no_face_is_flipped_by_laying_a_half_flat(prepared: PreparedBrain, half):
    assert (orientations(prepared.halves[half].flat.corners) == 1).all()


@pytest.mark.parametrize("half", HALVES)
def test_each_inner_vertex_of_a_flat_half_is_the_mean_of_its_neighbours(
    prepared: PreparedBrain, half
):
    own = prepared.halves[half]
    matrix, charge = mean_matrix(own.springs, len(own.vertex_of))
    u, v = own.flat.uv.T
    away = np.stack([matrix @ u + charge - u, matrix @ v - v], axis=1)
    is_inner = np.ones(len(u), dtype=bool)
    is_inner[own.outer] = is_inner[own.hole] = False
    assert np.abs(away[is_inner]).max() <= 1e-10


def test_what_comes_from_the_original_is_near_it(prepared: PreparedBrain):
    torus = prepared.torus
    kept = torus.origin_of_vertex == ORIGINS.index("original")
    away = distances_to_surface(torus.surface.vertices[kept], prepared.raw, ignore)
    assert away.mean() <= 0.001 * torus.surface.diagonal
    assert np.percentile(away, 99) <= 0.01 * torus.surface.diagonal


def test_the_oesophagus_is_near_the_midplane(prepared: PreparedBrain):
    frame, torus = prepared.torus.frame, prepared.torus
    x = frame.coordinates(torus.surface.vertices)[:, 0]
    center = frame.coordinates(np.array(torus.oesophagus.center_um))
    assert abs(center[0]) < 0.1 * np.ptp(x)
