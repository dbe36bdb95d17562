import numpy as np
import pytest

from flyreg_core.mesh_part import MeshPart
from flyreg_core.normals import face_normals
from tests.shapes import sphere


def areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """The areas of faces."""
    return np.linalg.norm(face_normals(vertices, faces), axis=1) / 2


def test_a_part_of_a_sphere_has_vertices_of_it_and_hides_its_inside() -> None:
    vertices, faces = sphere(1.0, rounds=6)
    part = MeshPart.of(vertices, faces, 16)
    kept = vertices[part.rows]
    assert len(part.faces) < len(faces) / 4
    assert areas(kept, part.faces).sum() == pytest.approx(4 * np.pi, rel=0.03)
    outwards = np.einsum("ij,ij->i", face_normals(kept, part.faces), kept[part.faces].mean(axis=1))
    assert (outwards > -1e-12).all()  # but for rounding, where a face stands upright
    np.testing.assert_array_equal(part.ring[part.places], part.rows)


def test_a_part_of_a_sheet_reaches_its_borders_and_corners() -> None:
    x, y = np.meshgrid(np.linspace(0, 3, 91), np.linspace(0, 2, 61))
    vertices = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 0.1)])
    lower = np.arange(x.size).reshape(x.shape)[:-1, :-1].ravel()
    faces = np.concatenate([lower[:, None] + [0, 1, 92], lower[:, None] + [0, 92, 91]])
    part = MeshPart.of(vertices, faces, 24)
    kept = vertices[part.rows]
    assert areas(kept, part.faces).sum() == pytest.approx(6, rel=1e-9)
    assert (face_normals(kept, part.faces)[:, 2] > 0).all()
    corners = {(0.0, 0.0), (3.0, 0.0), (0.0, 2.0), (3.0, 2.0)}
    assert corners <= {tuple(row) for row in kept[:, :2]}


def test_vertices_that_no_face_uses_change_nothing() -> None:
    vertices, faces = sphere(1.0, rounds=4)
    alone = MeshPart.of(vertices, faces, 12)
    far = np.array([[0.0, 50.0, 0.0]])
    among = MeshPart.of(np.concatenate([far, vertices, far]), faces + 1, 12)
    np.testing.assert_array_equal(among.rows, alone.rows + 1)
    np.testing.assert_array_equal(among.faces, alone.faces)


def test_a_mesh_without_faces_has_an_empty_part() -> None:
    part = MeshPart.of(np.zeros((3, 3)), np.zeros((0, 3), dtype=np.int64), 12)
    assert len(part.rows) == len(part.faces) == len(part.ring) == 0


def test_of_one_face_in_one_place_nothing_is_left() -> None:
    part = MeshPart.of(np.ones((3, 3)), np.array([[0, 1, 2]]), 12)
    assert len(part.rows) == 1
    assert len(part.faces) == 0
