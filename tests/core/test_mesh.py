import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from flyreg_core.errors import MeshError
from flyreg_core.mesh import FlatMesh, SurfaceMesh
from tests.shapes import box, inside_out, sphere, torus

SEEDS = st.integers(0, 2**32 - 1)


def test_what_a_mesh_was_made_from_may_change_without_changing_the_mesh():
    vertices, faces = box()
    mesh = SurfaceMesh(vertices, faces)
    before = vertices.copy()
    vertices += 1
    faces[:] = 0
    assert np.array_equal(mesh.vertices, before)
    assert mesh.faces.max() == 7


@pytest.mark.parametrize("name", ["vertices", "faces"])
def test_the_arrays_of_a_mesh_cannot_be_written_to(name):
    with pytest.raises(ValueError, match="read-only"):
        getattr(SurfaceMesh(*box()), name)[0] = 0


def test_arrays_that_cannot_be_written_to_are_shared():
    mesh = SurfaceMesh(*box())
    again = SurfaceMesh(mesh.vertices, mesh.faces)
    assert again.vertices is mesh.vertices
    assert again.faces is mesh.faces


def test_meshes_are_compared_by_identity():
    mesh = SurfaceMesh(*box())
    assert mesh == mesh
    assert mesh != SurfaceMesh(*box())
    assert len({mesh, SurfaceMesh(mesh.vertices, mesh.faces)}) == 2


def test_vertices_in_a_plane_are_no_surface():
    with pytest.raises(MeshError, match=r"vertices must have shape \(n, 3\), not \(8, 2\)"):
        SurfaceMesh(box()[0][:, :2], box()[1])


def test_faces_of_four_corners_are_no_triangles():
    with pytest.raises(MeshError, match=r"faces must have shape \(n, 3\), not \(1, 4\)"):
        SurfaceMesh(box()[0], np.array([[0, 1, 2, 3]]))


@pytest.mark.parametrize("number", [-1, 8])
def test_faces_use_only_vertices_that_exist(number):
    with pytest.raises(
        MeshError, match=rf"faces use vertices {min(number, 0)} to {max(number, 2)} of 8"
    ):
        SurfaceMesh(box()[0], np.array([[0, number, 2]]))


def test_the_volume_and_area_of_a_box_are_those_of_a_box():
    mesh = SurfaceMesh(*box((2.0, 3.0, 5.0), center=(100.0, -50.0, 7.0)))
    assert mesh.volume == pytest.approx(30.0)
    assert mesh.face_areas.sum() == pytest.approx(2 * (6 + 10 + 15))
    assert mesh.diagonal == pytest.approx(np.sqrt(38))


def test_a_surface_turned_inside_out_has_negative_volume():
    assert SurfaceMesh(*inside_out(box())).volume == -SurfaceMesh(*box()).volume < 0


@given(seed=SEEDS)
def test_areas_and_volume_agree_with_another_library(seed):
    vertices, faces = torus(around=9, across=7)
    vertices = vertices + np.random.default_rng(seed).normal(scale=30, size=vertices.shape)
    mesh, other = SurfaceMesh(vertices, faces), trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.face_areas == pytest.approx(other.area_faces)
    assert mesh.volume == pytest.approx(other.volume)
    unit = mesh.face_normals / (2 * mesh.face_areas[:, None])
    assert unit == pytest.approx(other.face_normals, abs=1e-7)


def test_the_normals_of_a_sphere_point_away_from_its_centre():
    vertices, faces = sphere(rounds=4)
    normals = SurfaceMesh(vertices, faces).vertex_normals
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1)
    assert (normals * vertices).sum(axis=1) / 100 == pytest.approx(1, abs=0.01)


def test_a_vertex_without_faces_has_no_normal():
    vertices, faces = box()
    normals = SurfaceMesh(np.vstack([vertices, [[1, 2, 3]]]), faces).vertex_normals
    assert np.array_equal(normals[-1], [0, 0, 0])
    assert (np.linalg.norm(normals[:-1], axis=1) > 0.99).all()


def test_the_corners_of_a_flat_face_are_shifted_by_whole_turns_along_u_only():
    flat = FlatMesh(
        np.array([[0.9, 0.0], [0.1, 0.2], [0.95, 1.0]]),
        np.array([[0, 1, 2]]),
        np.array([[0, 1, 0]]),
    )
    assert flat.corners == pytest.approx(np.array([[[0.9, 0.0], [1.1, 0.2], [0.95, 1.0]]]))
    assert flat.uv[1, 0] == 0.1


def test_each_array_of_a_flat_mesh_is_checked():
    uv, faces = np.zeros((3, 2)), np.array([[0, 1, 2]])
    with pytest.raises(MeshError, match=r"uv must have shape \(n, 2\), not \(3, 3\)"):
        FlatMesh(np.zeros((3, 3)), faces, faces)
    with pytest.raises(MeshError, match=r"corner_shifts must have shape \(n, 3\), not \(1, 2\)"):
        FlatMesh(uv, faces, faces[:, :2])
    with pytest.raises(MeshError, match="faces use vertices 0 to 2 of 2"):
        FlatMesh(uv[:2], faces, faces)
