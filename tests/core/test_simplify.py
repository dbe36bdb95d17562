import numpy as np
import pytest
import trimesh

from flyreg_core.errors import Cancelled, MeshError
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.progress import ignore
from flyreg_core.simplify import SimplifyParameters, simplify
from flyreg_core.topology import genus
from tests.shapes import box, sphere, together, torus


def rough(shape):
    """The shape with vertices moved a little, so that no two edges are alike."""
    vertices, faces = shape
    return vertices + np.random.default_rng(1).normal(scale=0.3, size=vertices.shape), faces


FINE = rough(torus(around=120, across=60))


def simplified(shape, vertices):
    return simplify(SurfaceMesh(*shape), SimplifyParameters(vertices), ignore)


@pytest.mark.parametrize("wanted", [None, 8, 1000])
def test_a_surface_with_no_more_vertices_than_wanted_stays(wanted):
    surface = SurfaceMesh(*box())
    result = simplify(surface, SimplifyParameters(wanted), ignore)
    assert result.surface is surface
    assert (result.mean_distance_um, result.largest_distance_um, result.area_share) == (0, 0, 1)
    assert result.warnings == ()


@pytest.mark.parametrize("wanted", [600, 1000, 4000])
def test_at_most_as_many_vertices_are_left_as_wanted_and_not_many_fewer(wanted):
    count = len(simplified(FINE, wanted).surface.vertices)
    assert 0.8 * wanted <= count <= wanted


@pytest.mark.parametrize("wanted", [600, 4000])
def test_a_simplified_surface_is_closed_and_keeps_its_handle(wanted):
    surface = simplified(FINE, wanted).surface
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.is_watertight
    assert genus(surface.faces) == 1
    assert surface.volume > 0


def test_the_distances_told_are_those_of_the_old_vertices_to_the_new_surface():
    result = simplified(FINE, 500)
    mesh = trimesh.Trimesh(result.surface.vertices, result.surface.faces, process=False)
    _, away, _ = trimesh.proximity.closest_point(mesh, FINE[0])
    assert result.mean_distance_um == pytest.approx(away.mean())
    assert result.largest_distance_um == pytest.approx(away.max())
    assert 0 < result.mean_distance_um < result.largest_distance_um


def test_the_area_share_is_the_new_area_over_the_old_one():
    result = simplified(FINE, 500)
    area = [
        trimesh.Trimesh(*shape, process=False).area
        for shape in (FINE, (result.surface.vertices, result.surface.faces))
    ]
    assert result.area_share == pytest.approx(area[1] / area[0])
    assert 0.8 < result.area_share < 1.02


def test_fewer_vertices_lie_farther_from_the_old_surface():
    away = [simplified(FINE, wanted).mean_distance_um for wanted in (4000, 1500, 600)]
    assert away[0] < away[1] < away[2] < 20


def test_fewer_vertices_than_the_paper_found_enough_are_warned_of():
    assert simplified(FINE, 4000).warnings == (
        "4000 vertices are fewer than 10000: expect a distorted shape",
    )


def test_less_than_a_fifth_of_the_vertices_is_warned_of():
    many = rough(sphere(rounds=7))  # 65,538 vertices
    assert simplified(many, 12_000).warnings == (
        "12000 of 65538 vertices are less than a fifth: expect a distorted shape",
    )


def test_enough_vertices_are_not_warned_of():
    assert simplified(rough(sphere(rounds=6)), 12_000).warnings == ()  # of 16,386


@pytest.mark.parametrize("wanted", [99, 0, -5])
def test_too_few_vertices_for_a_brain_are_refused(wanted):
    words = f"{wanted} vertices cannot describe a brain; keep at least 10000"
    with pytest.raises(MeshError, match=words):
        simplified(FINE, wanted)


def test_a_surface_that_cannot_become_so_coarse_is_refused_with_the_fewest_possible():
    cubes = [
        box((9.0, 9, 9), (x, y, z)) for x in (0, 20, 40) for y in (0, 20, 40) for z in (0, 20, 40)
    ]
    words = "the surface cannot be simplified to 100 vertices without losing its shape; 216 is the"
    with pytest.raises(MeshError, match=words):
        simplified(together(*cubes), 100)


def test_simplifying_can_be_cancelled():
    def cancel(fraction, text):
        raise Cancelled

    with pytest.raises(Cancelled):
        simplify(SurfaceMesh(*FINE), SimplifyParameters(500), cancel)


def test_the_same_surface_is_simplified_to_the_same_bytes():
    one, other = (simplified(FINE, 500).surface for _ in range(2))
    assert np.array_equal(one.vertices, other.vertices)
    assert np.array_equal(one.faces, other.faces)


def test_the_surface_that_was_given_is_not_changed():
    surface = SurfaceMesh(*FINE)
    simplify(surface, SimplifyParameters(500), ignore)
    assert np.array_equal(surface.vertices, FINE[0])
    assert np.array_equal(surface.faces, FINE[1])
