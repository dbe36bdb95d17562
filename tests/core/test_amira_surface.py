"""Amira surfaces give what borders the exterior, seen from there."""

import numpy as np
import pytest

from flyreg_core.brain_files import open_brain, read_brain
from flyreg_core.errors import InputError
from flyreg_core.topology import genus, is_closed
from tests.shapes import box, torus

PARAMETERS = """Parameters {
    Materials {
        Exterior { Id 1 }
        Inside { Color 0.64 0 0.8, Id 2 }
    }
    BoundaryIds { Id0 { Id 0, Info "undefined" } Name "BoundaryConditions" }
}
"""
KINDS = ["ASCII", "BINARY", "BINARY-LITTLE-ENDIAN"]


def numbers(values, kind):
    """Encode coordinates or numbers of vertices."""
    if kind == "ASCII":
        return "".join(" ".join(map(repr, row)) + "\n" for row in values.tolist()).encode()
    letter = "f" if values.dtype.kind == "f" else "i"
    return values.astype(f"{'<' if kind.endswith('N') else '>'}{letter}4").tobytes() + b"\n"


def encoded(vertices, patches, kind="ASCII", curves=()):
    """Encode patches: inner region, outer region, faces counter-clockwise seen from outer."""
    parts = [
        f"# HyperSurface 0.1 {kind}\n\n{PARAMETERS}\nVertices {len(vertices)}\n".encode(),
        numbers(vertices, kind),
        f"NBranchingPoints 0\nNVerticesOnCurves 0\nBoundaryCurves {len(curves)}\n".encode(),
    ]
    for curve in curves:
        parts += [f"{{\nVertices {len(curve)}\n".encode(), numbers(curve[:, None] + 1, kind)]
        parts.append(b"}\n")
    parts.append(f"Patches {len(patches)}\n".encode())
    for inner, outer, faces in patches:
        about = f"{{\nInnerRegion {inner}\nOuterRegion {outer}\nBoundaryID 0\nBranchingPoints 0\n"
        parts += [f"{about}\nTriangles {len(faces)}\n".encode(), numbers(faces + 1, kind), b"}\n"]
    return b"".join([*parts, b"Surfaces 0\n"])


def read(path, content):
    path.write_bytes(content)
    return read_brain(open_brain(str(path)))


def single(vertices, faces, kind="ASCII"):
    return encoded(vertices, [("Inside", "Exterior", faces)], kind)


@pytest.mark.parametrize("kind", KINDS)
def test_a_surface_is_read_as_it_was_written(tmp_path, kind):
    vertices, faces = torus()
    mesh = read(tmp_path / "a.surf", single(vertices, faces, kind))
    np.testing.assert_allclose(mesh.vertices, vertices, atol=0 if kind == "ASCII" else 3e-5)
    np.testing.assert_array_equal(mesh.faces, faces)


def test_a_surf_file_is_a_surface(tmp_path):
    (tmp_path / "a.surf").write_bytes(single(*torus()))
    brain = open_brain(str(tmp_path / "a.surf"))
    assert (brain.kind, brain.unit, brain.unit_known_by) == (
        "surface",
        "um",
        "judged from the size",
    )


def test_a_template_comes_back_from_a_surf_file(tmp_path):
    raw = read_brain(open_brain("FCWB"))
    mesh = read(tmp_path / "a.surf", single(raw.vertices, raw.faces, "BINARY"))
    np.testing.assert_allclose(mesh.vertices, raw.vertices, atol=1e-4)
    np.testing.assert_array_equal(mesh.faces, raw.faces)


@pytest.mark.parametrize("kind", KINDS)
def test_patches_face_outwards_whichever_side_is_called_inner(tmp_path, kind):
    vertices, faces = torus()
    half = len(faces) // 2
    patches = [
        ("Inside", "Exterior", faces[:half]),
        ("Exterior", "Inside", faces[half:, ::-1]),
    ]
    mesh = read(tmp_path / "a.surf", encoded(vertices, patches, kind))
    assert is_closed(mesh.faces)
    assert genus(mesh.faces) == 1
    assert mesh.volume > 0


@pytest.mark.parametrize("kind", KINDS)
def test_walls_between_regions_are_left_out(tmp_path, kind):
    vertices, faces = box()
    wall = np.array([[0, 1, 6]])
    patches = [
        ("Left", "Exterior", faces[:4]),
        ("Left", "Right", wall),
        ("Right", "Exterior", faces[4:]),
    ]
    curves = [np.array([0, 1, 3]), np.array([4, 6])]
    mesh = read(tmp_path / "a.surf", encoded(vertices, patches, kind, curves))
    assert len(mesh.faces) == 12
    assert is_closed(mesh.faces)


@pytest.mark.parametrize("name", ["exterior", "EXTERIOR", '"Exterior"', "outside", ""])
def test_the_exterior_has_several_names(tmp_path, name):
    vertices, faces = torus()
    assert len(read(tmp_path / "a.surf", encoded(vertices, [("A", name, faces)])).faces) == len(
        faces
    )


# Bad input, one sentence each


def refused(tmp_path, content):
    with pytest.raises(InputError) as caught:
        read(tmp_path / "a.surf", content)
    return str(caught.value)


def test_a_surface_without_an_exterior_is_named(tmp_path):
    vertices, faces = torus()
    message = refused(tmp_path, encoded(vertices, [("Left", "Right", faces)]))
    assert "has no patch that borders the exterior; its regions are left, right; save" in message


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("share", [0.03, 0.2, 0.5, 0.9])
def test_a_truncated_file_is_named(tmp_path, kind, share):
    content = single(*torus(), kind)
    assert "is damaged or cut short" in refused(tmp_path, content[: int(len(content) * share)])


def test_content_of_another_kind_is_no_mesh(tmp_path):
    assert "its content is not what the ending .surf promises" in refused(tmp_path, b"Dear reader")


def test_an_index_out_of_range_is_counted(tmp_path):
    vertices, faces = box()
    message = refused(tmp_path, single(vertices, np.vstack([faces, [[0, 1, 8]]])))
    assert "1 of 13 faces use vertices that do not exist (it has 8)" in message


def test_coordinates_that_are_no_numbers_are_counted(tmp_path):
    vertices, faces = box()
    vertices[3, 1] = np.nan
    message = refused(tmp_path, single(vertices, faces, "BINARY"))
    assert "1 of 8 vertices have coordinates that are infinite or no numbers" in message


def test_two_brains_are_refused(tmp_path):
    vertices, faces = box()
    both = np.vstack([vertices, vertices + np.array([700, 0, 0])])
    content = single(both, np.vstack([faces, faces + len(vertices)]))
    assert "holds two brains or halves of one" in refused(tmp_path, content)
