"""Neuropils in files, and the landmarks near them."""

import numpy as np
import pytest
import trimesh

from flyreg_core.correspondence import PlacedLandmark
from flyreg_core.errors import InputError
from flyreg_core.landmarks import LandmarkPair
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.neuropils import (
    Neuropil,
    near_neuropil,
    near_place,
    open_neuropils,
    read_neuropils,
)


def ball(center, radius=10.0):
    mesh = trimesh.creation.icosphere(2, radius)
    return mesh.vertices + center, mesh.faces


def landmark(number, source, target):
    pair = LandmarkPair(f"p{number}", f"p{number}", "interior", None, tuple(source), tuple(target))
    return PlacedLandmark(pair, np.array(source), np.array(target), 0, np.ones(3) / 3, {})


def obj(parts):
    lines, start = [], 1
    for name, (vertices, faces) in parts.items():
        lines.append(f"g {name}")
        lines += ["v {:.6f} {:.6f} {:.6f}".format(*row) for row in vertices]
        lines += ["f {} {} {}".format(*row) for row in faces + start]
        start += len(vertices)
    return "\n".join(lines)


def glb(path, parts):
    scene = trimesh.Scene()
    for name, (vertices, faces) in parts.items():
        scene.add_geometry(trimesh.Trimesh(vertices, faces), geom_name=name, node_name=name)
    path.write_bytes(scene.export(file_type="glb"))


PARTS = {"AL_L": ball([20, 0, 0]), "AL_R": ball([-20, 0, 0], 6.0)}


@pytest.mark.parametrize("ending", [".obj", ".glb"])
def test_each_part_of_a_file_is_a_neuropil_of_its_own(tmp_path, ending):
    path = tmp_path / f"regions{ending}"
    if ending == ".obj":
        path.write_text(obj(PARTS))
    else:
        glb(path, PARTS)
    found = read_neuropils(open_neuropils(path, "target", "um"))
    assert [neuropil.name for neuropil in found] == ["AL_L", "AL_R"]
    for neuropil, (vertices, _) in zip(found, PARTS.values(), strict=True):
        assert neuropil.role == "target"
        assert neuropil.surface.vertices.mean(axis=0) == pytest.approx(
            vertices.mean(axis=0), abs=1e-5
        )


def test_a_file_without_names_is_one_neuropil_named_as_the_file_in_micrometres(tmp_path):
    vertices, faces = PARTS["AL_L"]
    path = tmp_path / "calyx.stl"
    trimesh.Trimesh(1000 * vertices, faces).export(path)
    (found,) = read_neuropils(open_neuropils(path, "source", "nm"))
    assert found.name == "calyx"
    assert np.ptp(found.surface.vertices, axis=0) == pytest.approx(
        np.ptp(vertices, axis=0), rel=1e-5
    )


def test_landmarks_near_a_neuropil_are_those_within_reach_on_its_own_brain():
    neuropil = Neuropil("AL", "target", SurfaceMesh(*PARTS["AL_L"]))
    marks = [
        landmark(1, (0, 0, 0), (20, 0, 14)),
        landmark(2, (20, 0, 10), (20, 0, 17)),
        landmark(3, (0, 0, 0), (-20, 0, 0)),
    ]
    assert near_neuropil(neuropil, marks, 5.0) == ("p1",)
    assert near_neuropil(neuropil, marks, 8.0) == ("p1", "p2")


def test_landmarks_near_a_place_are_those_within_reach():
    marks = [landmark(1, (0, 0, 3), (9, 0, 0)), landmark(2, (0, 0, 5), (0, 0, 0))]
    assert near_place(np.zeros(3), "source", marks, 4.0) == ("p1",)
    assert near_place(np.zeros(3), "target", marks, 4.0) == ("p2",)
    assert near_place(np.zeros(3), "target", [], 4.0) == ()


def test_a_file_that_is_no_mesh_is_refused(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("nothing")
    with pytest.raises(InputError, match=r"a\.txt is no mesh file; neuropils are read from \.ply"):
        open_neuropils(path, "source", "um")


def test_a_file_without_faces_is_refused(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    with pytest.raises(InputError, match=r"a\.obj holds no face"):
        open_neuropils(path, "source", "um")


def test_a_file_that_changed_is_noticed(tmp_path):
    path = tmp_path / "regions.obj"
    path.write_text(obj(PARTS))
    file = open_neuropils(path, "source", "um")
    path.write_text(obj({"AL_L": PARTS["AL_L"]}))
    with pytest.raises(InputError, match="has changed since the project was saved"):
        read_neuropils(file)
