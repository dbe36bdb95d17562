"""Vertex pairs for other programs: where the surface goes, in the units of the files."""

import numpy as np
import pytest

from flyreg_core.cut import PIECES
from flyreg_core.errors import FlyregError
from flyreg_core.pipeline import Pipeline
from flyreg_core.thin_plate_spline import fit_thin_plate_spline
from flyreg_core.vertex_pairs import choose_vertices, write_vertex_pairs


@pytest.fixture(scope="module")
def results(demo_project):
    return Pipeline().run(demo_project, measure=False)


def test_the_vertices_are_different_spread_out_and_on_no_trim_cap(results):
    chosen = choose_vertices(results, 300)
    assert len(np.unique(chosen)) == 300
    faces = results.source.surface.faces
    pieces = results.source.flat.dissection.piece_of_face
    in_halves = np.unique(
        faces[np.isin(pieces, [PIECES.index("anterior"), PIECES.index("posterior")])]
    )
    assert np.isin(chosen, in_halves).all()
    points = results.source.surface.vertices
    away = np.linalg.norm(points[in_halves][:, None] - points[chosen][None], axis=2).min(axis=1)
    apart = np.linalg.norm(points[chosen][:, None] - points[chosen][None], axis=2)
    assert away.max() <= (apart + 1e9 * np.eye(300)).min() + 1e-9


def test_a_spline_through_the_pairs_carries_the_other_vertices_nearly_as_the_registration(
    results, tmp_path
):
    path = tmp_path / "pairs.csv"
    assert write_vertex_pairs(path, results, 800) == 800
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    assert path.read_text().startswith("x,y,z,x_registered,y_registered,z_registered\n")
    spline = fit_thin_plate_spline(rows[:, :3], rows[:, 3:], np.ones(len(rows)), 0.0)
    others = choose_vertices(results, 1200)[800:]
    carried = spline(results.source.surface.vertices[others])
    away = np.linalg.norm(carried - results.registration.surface.vertices[others], axis=1)
    assert np.median(away) < 1.0


def test_too_few_pairs_are_refused(results):
    with pytest.raises(FlyregError, match="at least 4 vertex pairs are needed, not 3"):
        choose_vertices(results, 3)
