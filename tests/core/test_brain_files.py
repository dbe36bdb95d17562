import filecmp
import hashlib
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from flyreg_core.brain_files import (
    UM_PER_UNIT,
    accept_changed_file,
    open_brain,
    read_brain,
    template_file,
    template_labels,
    write_mesh,
)
from flyreg_core.errors import InputError
from flyreg_core.mesh import SurfaceMesh
from tests.shapes import BRAIN_SIZE, box, inside_out, together, torus

CHECKOUT = Path(__file__).parents[2]
EXACT = [".ply", ".obj", ".off", ".vtk"]
ROUNDED = [".stl", ".glb"]
FORMATS = EXACT + ROUNDED

PLY = """ply
format ascii 1.0
element vertex 4
property double x
property double y
property double z
element face 4
property list uchar int vertex_indices
end_header
0 0 0
500 0 0
0 300 0
0 0 200
3 0 2 1
3 0 1 3
3 0 3 2
3 1 2 3
"""


def as_mesh(shape):
    vertices, faces = shape
    return SurfaceMesh(vertices + 0.1, faces)  # 0.1 so that rounding shows


def written(path, shape=None, unit="um", **properties):
    write_mesh(path, as_mesh(shape or torus()), unit, properties)
    return path


def opened(path, text):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return open_brain(str(path))


def read(path, unit=None):
    return read_brain(open_brain(str(path), unit))


# Reading what was written


@pytest.mark.parametrize("suffix", EXACT)
def test_writing_and_reading_gives_identical_vertices(tmp_path, suffix):
    np.testing.assert_array_equal(
        read(written(tmp_path / f"a{suffix}")).vertices, as_mesh(torus()).vertices
    )


@pytest.mark.parametrize("suffix", FORMATS)
def test_writing_and_reading_moves_no_corner_farther_than_single_precision(tmp_path, suffix):
    mesh, again = as_mesh(torus()), read(written(tmp_path / f"a{suffix}"))
    np.testing.assert_allclose(
        again.vertices[again.faces], mesh.vertices[mesh.faces], rtol=0, atol=3e-5
    )


@pytest.mark.parametrize("suffix", EXACT)
def test_writing_and_reading_gives_the_same_faces(tmp_path, suffix):
    np.testing.assert_array_equal(read(written(tmp_path / f"a{suffix}")).faces, torus()[1])


@pytest.mark.parametrize("suffix", FORMATS)
def test_the_number_of_vertices_stays(tmp_path, suffix):
    assert len(read(written(tmp_path / f"a{suffix}")).vertices) == len(torus()[0])


@pytest.mark.parametrize("suffix", FORMATS)
def test_equal_meshes_give_equal_bytes(tmp_path, suffix):
    one, other = written(tmp_path / f"a{suffix}"), written(tmp_path / f"b{suffix}")
    assert filecmp.cmp(one, other, shallow=False)


@pytest.mark.parametrize("unit", ["nm", "um", "mm"])
def test_a_mesh_is_written_in_the_unit_that_was_asked_for(tmp_path, unit):
    vertices = trimesh.load(written(tmp_path / "a.ply", unit=unit), process=False).vertices
    np.testing.assert_allclose(vertices * UM_PER_UNIT[unit], as_mesh(torus()).vertices)


def test_properties_are_named_in_ply_files(tmp_path):
    weights, moved = np.linspace(0, 1, 8), np.arange(8) % 2 == 0
    path = written(tmp_path / "a.ply", box(), weight_influence=weights, is_moved=moved)
    data = trimesh.load(path, process=False).metadata["_ply_raw"]["vertex"]["data"]
    np.testing.assert_array_equal(data["weight_influence"].ravel(), weights)
    np.testing.assert_array_equal(data["is_moved"].ravel(), moved)


def test_properties_are_named_in_vtk_files(tmp_path):
    content = written(tmp_path / "a.vtk", box(), status=np.arange(8)).read_bytes()
    start = content.index(b"SCALARS status double 1\nLOOKUP_TABLE default\n") + 45
    np.testing.assert_array_equal(np.frombuffer(content, ">f8", 8, start), np.arange(8))


def test_a_format_that_cannot_be_written_is_named(tmp_path):
    with pytest.raises(InputError, match=r"cannot be written as \.xyz; choose one of \.ply, "):
        written(tmp_path / "a.xyz")


# Units


def test_a_stated_unit_is_taken(tmp_path):
    brain = open_brain(str(written(tmp_path / "a.ply", unit="nm")), "nm")
    assert (brain.unit, brain.unit_known_by) == ("nm", "stated by the user")


@pytest.mark.parametrize("unit", ["nm", "um", "mm"])
def test_a_unit_is_judged_from_the_size(tmp_path, unit):
    brain = open_brain(str(written(tmp_path / "a.ply", unit=unit)))
    assert (brain.unit, brain.unit_known_by) == (unit, "judged from the size")


@pytest.mark.parametrize("unit", ["nm", "um", "mm"])
def test_brains_are_read_in_micrometres(tmp_path, unit):
    assert np.ptp(read(written(tmp_path / "a.ply", unit=unit)).vertices, axis=0).max() == (
        pytest.approx(560)
    )


def test_a_size_of_no_brain_asks_for_the_unit(tmp_path):
    with pytest.raises(
        InputError, match=r"it is 30,000 units across, .* state the unit with --source-unit"
    ):
        open_brain(str(written(tmp_path / "a.ply", box((30_000, 9_000, 9_000)))))


def test_an_unusual_size_is_taken_if_the_unit_is_stated(tmp_path):
    path = written(tmp_path / "a.ply", box((2500, 900, 900)))
    assert open_brain(str(path), "um").unit == "um"


@pytest.mark.parametrize(("unit", "um"), [("nm", "0.56"), ("mm", "560,000")])
def test_a_unit_that_is_off_by_a_thousand_is_refused(tmp_path, unit, um):
    with pytest.raises(InputError, match=rf"in {unit} it is {um} um, .* off by 1,000 or so"):
        open_brain(str(written(tmp_path / "a.ply")), unit)


# Templates of the flybrains package


@pytest.mark.parametrize(
    ("label", "unit", "vertices"),
    [("JFRC2", "um", 8988), ("FCWB", "um", 8859), ("FAFB14", "nm", 25047)],
)
def test_a_template_is_read_in_the_unit_of_its_metadata(label, unit, vertices):
    brain = open_brain(label)
    assert (brain.name, brain.unit, brain.unit_known_by) == (label, unit, "template metadata")
    assert len(read_brain(brain).vertices) == vertices


def test_a_part_of_a_template_has_the_unit_of_the_whole():
    brain = open_brain("JRCFIB2022M_brain")
    assert (brain.unit, brain.unit_known_by) == ("nm", "template metadata")


def test_a_template_without_a_unit_is_judged_from_its_size():
    brain = open_brain("DsecI")
    assert (brain.unit, brain.unit_known_by) == ("um", "judged from the size")


@pytest.mark.parametrize("label", ["JRCFIB2018Fraw", "MANCraw"])
def test_a_template_in_voxels_is_refused(label):
    with pytest.raises(InputError, match=f"the template {label} is measured in voxels"):
        open_brain(label)


def test_templates_are_the_stems_of_the_mesh_files():
    assert {"JFRC2", "FCWB", "JRC2018F", "FAFB14", "JRCFIB2022M_brain"} <= set(template_labels())
    assert template_file("JFRC2").name == "JFRC2.ply"
    assert template_file("JFRC3") is None


def test_finding_templates_does_not_import_their_package():
    code = (
        "import sys; from flyreg_core.brain_files import open_brain; open_brain('JFRC2'); "
        "sys.exit('flybrains' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=CHECKOUT)


def test_a_file_goes_before_a_template_of_the_same_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "JFRC2").write_text("text")
    with pytest.raises(InputError, match=r"unknown ending \(none\)"):
        open_brain("JFRC2")


@pytest.mark.parametrize("typed", ["JFRC", "jfrc2", "JRFC2"])
def test_a_misspelt_template_is_answered_with_similar_ones(typed):
    with pytest.raises(InputError, match=f"no template {typed}; similar templates are .*JFRC2"):
        open_brain(typed)


def test_a_name_like_no_template_is_answered_with_all_of_them():
    with pytest.raises(InputError, match=r"no template qqqqq; templates are AEDES, .*, VNCIS1"):
        open_brain("qqqqq")


def test_without_the_package_it_is_told_how_to_install_it(monkeypatch):
    monkeypatch.setattr(sys, "path", [])
    with pytest.raises(InputError, match=r'no file JFRC2; .* pip install "flyreg\[templates\]"'):
        open_brain("JFRC2")
    assert template_labels() == ()
    assert template_file("JFRC2") is None


def test_a_package_without_metadata_still_gives_its_templates(tmp_path, monkeypatch):
    package = tmp_path / "flybrains"
    (package / "meshes").mkdir(parents=True)
    (package / "__init__.py").touch()
    written(package / "meshes" / "MINE.ply")
    monkeypatch.setattr(sys, "path", [str(tmp_path)])
    assert open_brain("MINE").unit_known_by == "judged from the size"


# What a brain's file is


def test_the_checksum_is_that_of_the_file(tmp_path):
    path = written(tmp_path / "a.ply")
    assert open_brain(str(path)).sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


def test_the_path_is_absolute_and_the_name_is_as_given(tmp_path, monkeypatch):
    written(tmp_path / "a.ply")
    monkeypatch.chdir(tmp_path)
    brain = open_brain("a.ply")
    assert (brain.name, Path(brain.path)) == ("a.ply", tmp_path / "a.ply")


def test_a_changed_file_is_refused(tmp_path):
    brain = open_brain(str(written(tmp_path / "a.ply")))
    written(tmp_path / "a.ply", box())
    with pytest.raises(InputError, match="has changed since the project was saved; accept the new"):
        read_brain(brain)


def test_a_changed_file_can_be_accepted(tmp_path):
    brain = open_brain(str(written(tmp_path / "a.ply")), "um")
    written(tmp_path / "a.ply", box())
    accepted = accept_changed_file(brain)
    assert len(read_brain(accepted).vertices) == 8
    assert accepted == replace(brain, sha256=accepted.sha256)


def test_endings_may_be_in_capitals(tmp_path):
    assert len(read(written(tmp_path / "a.PLY")).vertices) == len(torus()[0])


# What is done to a mesh


def test_a_mesh_that_is_inside_out_is_turned(tmp_path):
    mesh = read(written(tmp_path / "a.ply", inside_out(torus())))
    assert mesh.volume == pytest.approx(as_mesh(torus()).volume)


def test_vertices_that_no_face_uses_are_left_out(tmp_path):
    vertices, faces = box()
    stray = (np.vstack([[[9999.0, 0.0, 0.0]], vertices]), faces + 1)
    np.testing.assert_array_equal(read(written(tmp_path / "a.ply", stray)).vertices, vertices + 0.1)


def test_stl_vertices_are_merged_in_the_order_in_which_they_come(tmp_path):
    assert read(written(tmp_path / "a.stl", box())).faces.flatten()[:6].tolist() == [
        0, 1, 2, 0, 2, 3,
    ]  # fmt: skip


def test_parts_of_a_scene_are_put_together_where_their_transforms_put_them(tmp_path):
    scene = trimesh.Scene()
    for x in (-150, 150):
        part = trimesh.creation.box((300, 200, 100))
        scene.add_geometry(part, transform=trimesh.transformations.translation_matrix((x, 0, 0)))
    (tmp_path / "a.glb").write_bytes(scene.export(file_type="glb"))
    assert np.ptp(read(tmp_path / "a.glb").vertices, axis=0).tolist() == [600, 200, 100]


def test_a_gltf_file_is_read_with_its_buffers(tmp_path):
    vertices, faces = (
        values.astype(kind) for values, kind in zip(box(), ("<f4", "<u4"), strict=True)
    )
    (tmp_path / "a.bin").write_bytes(vertices.tobytes() + faces.tobytes())
    views = [
        {"buffer": 0, "byteOffset": 0, "byteLength": vertices.nbytes},
        {"buffer": 0, "byteOffset": vertices.nbytes, "byteLength": faces.nbytes},
    ]
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3"},
        {"bufferView": 1, "componentType": 5125, "count": faces.size, "type": "SCALAR"},
    ]
    content = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "a.bin", "byteLength": vertices.nbytes + faces.nbytes}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    (tmp_path / "a.gltf").write_text(json.dumps(content))
    np.testing.assert_array_equal(read(tmp_path / "a.gltf").vertices, vertices)


def test_polygons_of_an_obj_file_are_cut_and_its_groups_stay_sewn(tmp_path):
    corners = [(0, 0, 0), (0, 0, 200), (0, 300, 0), (0, 300, 200)]
    corners += [(500, y, z) for _, y, z in corners]
    lines = [f"v {x} {y} {z} 1.0" for x, y, z in corners]
    lines += ["o one", "vt 0 0", "f 1/1 2/1 4/1 3/1", "f 5/1 7/1 8/1 6/1", "usemtl other"]
    lines += ["f 1//1 5//1 6//1 2//1", "f 3 4 8 7", "f -8 -6 -2 -4", "f 2 6 8 \\", "4", "# end"]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    mesh = read(tmp_path / "a.obj")
    assert (len(mesh.vertices), len(mesh.faces)) == (8, 12)
    assert mesh.volume == pytest.approx(500 * 300 * 200)


def test_an_off_file_may_have_comments_colours_and_polygons(tmp_path):
    (tmp_path / "a.off").write_text(
        "# made by hand\nOFF\n\n5 5 0\n0 0 0\n500 0 0\n500 300 0\n0 300 0 # corner\n"
        "200 200 200\n4 0 3 2 1 255 0 0\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n"
    )
    mesh = read(tmp_path / "a.off")
    assert len(mesh.faces) == 6
    assert mesh.volume == pytest.approx(500 * 300 * 200 / 3)


VTK_5 = """# vtk DataFile Version 5.1
vtk output
ASCII
DATASET POLYDATA
FIELD FieldData 1
TimeValue 1 1 double
0
POINTS 4 float
0 0 0 500 0 0 0 300 0
0 0 200
METADATA
INFORMATION 1
NAME something LOCATION vtkDataArray
DATA 2 0 1

VERTICES 2 1
OFFSETS vtktypeint64
0 1
CONNECTIVITY vtktypeint64
3
POLYGONS 5 12
OFFSETS vtktypeint64
0 3 6 9 12
CONNECTIVITY vtktypeint64
0 2 1 0 1 3 0 3 2
1 2 3

POINT_DATA 4
"""
VTK_GRID = """# vtk DataFile Version 3.0
grid
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 4 double
0 0 0 500 0 0 0 300 0 0 0 200
CELLS 6 24
3 0 2 1
3 0 1 3
3 0 3 2
3 1 2 3
4 0 1 2 3
2 0 1
CELL_TYPES 6
5 5 5 5 10 3
"""


@pytest.mark.parametrize("text", [VTK_5, VTK_GRID], ids=["version 5.1", "unstructured grid"])
def test_vtk_text_files_are_read(tmp_path, text):
    (tmp_path / "a.vtk").write_text(text)
    mesh = read(tmp_path / "a.vtk")
    assert len(mesh.faces) == 4
    assert mesh.volume == pytest.approx(500 * 300 * 200 / 6)


# Bad input, one sentence each


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"there is no file .*a\.ply; check its name and folder"):
        open_brain(str(tmp_path / "a.ply"))


def test_a_folder_is_named(tmp_path):
    with pytest.raises(InputError, match="is a folder; choose a file in it"):
        open_brain(str(tmp_path))


def test_an_empty_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"a\.ply is empty \(0 bytes\)"):
        opened(tmp_path / "a.ply", "")


def test_an_unknown_ending_is_answered_with_the_known_ones(tmp_path):
    with pytest.raises(
        InputError, match=r"ending \.blend; flyreg reads \.asc, .*, \.stl, .*, \.xyz"
    ):
        opened(tmp_path / "a.blend", "text")


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".off", ".gltf", ".glb", ".vtk"])
def test_content_of_another_kind_is_no_mesh(tmp_path, suffix):
    with pytest.raises(InputError, match=rf"is not a mesh: .* the ending {suffix} promises"):
        opened(tmp_path / f"a{suffix}", "Dear reader,\nthis is a letter.\n")


def test_a_short_text_is_no_stl_file(tmp_path):
    with pytest.raises(InputError, match="is not a mesh: 14 bytes are too few for an STL file"):
        opened(tmp_path / "a.stl", "this is no STL")


@pytest.mark.parametrize("suffix", [".ply", ".off", ".vtk", ".stl", ".glb"])
@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_truncated_file_is_named(tmp_path, suffix, share):
    content = written(tmp_path / f"a{suffix}").read_bytes()
    with pytest.raises(InputError, match="cut short"):
        opened(tmp_path / f"a{suffix}", content[: int(len(content) * share)])


def test_an_obj_file_that_ends_within_a_line_is_named(tmp_path):
    content = written(tmp_path / "a.obj", box()).read_bytes()
    with pytest.raises(InputError, match="cut short: line 20 has 2 of at least 3 numbers; copy"):
        opened(tmp_path / "a.obj", content.rpartition(b" ")[0])


def test_a_truncated_text_file_says_how_much_is_missing(tmp_path):
    with pytest.raises(InputError, match="cut short: it promises 4 faces and holds 3; copy"):
        opened(tmp_path / "a.ply", PLY.rpartition("3 1 2 3")[0])


def test_a_truncated_stl_text_file_is_named(tmp_path):
    solid = trimesh.Trimesh(*box(), process=False).export(file_type="stl_ascii")
    with pytest.raises(InputError, match="cut short: its last line is not endsolid"):
        opened(tmp_path / "a.stl", solid[: len(solid) // 2])


@pytest.mark.parametrize("text", ["nan", "inf", "-inf"])
def test_coordinates_that_are_no_numbers_are_counted(tmp_path, text):
    damaged = PLY.replace("0 300 0", f"0 {text} 0").replace("500 0 0", f"500 0 {text}")
    with pytest.raises(InputError, match="2 of 4 vertices have coordinates that are"):
        opened(tmp_path / "a.ply", damaged)


@pytest.mark.parametrize("index", [4, 99, -1])
def test_an_index_out_of_range_is_counted(tmp_path, index):
    with pytest.raises(InputError, match=r"1 of 4 faces use vertices .* \(it has 4\)"):
        opened(tmp_path / "a.ply", PLY.replace("3 1 2 3", f"3 1 2 {index}"))


@pytest.mark.parametrize("index", [0, 4, -4])
def test_an_index_of_an_obj_file_out_of_range_is_counted(tmp_path, index):
    with pytest.raises(InputError, match="1 of 1 faces use vertices that do not exist"):
        opened(tmp_path / "a.obj", f"v 0 0 0\nv 500 0 0\nv 0 500 0\nf 1 2 {index}\n")


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_a_few_points_are_no_brain(tmp_path, suffix):
    points = trimesh.PointCloud(box()[0])
    content = {
        ".ply": points.export(file_type="ply"),
        ".obj": b"".join(b"v %f %f %f\n" % tuple(point) for point in points.vertices),
    }
    with pytest.raises(InputError, match="no faces, only 8 points, too few for a surface; give"):
        opened(tmp_path / f"a{suffix}", content[suffix])


@pytest.mark.parametrize("suffix", [".vtp", ".vtu"])
def test_what_cannot_be_read_is_to_be_converted(tmp_path, suffix):
    with pytest.raises(InputError, match="VTK XML file, which flyreg cannot read; convert its"):
        opened(tmp_path / f"a{suffix}", "text")


def test_meshes_have_no_voxels(tmp_path):
    with pytest.raises(InputError, match=r"a\.ply has no voxels; leave the voxel size out"):
        open_brain(str(written(tmp_path / "a.ply")), voxel_size_um=(1.0, 1.0, 1.0))


def test_an_image_in_a_vtk_file_is_no_surface(tmp_path):
    with pytest.raises(InputError, match=r"a\.vtk is no surface but STRUCTURED_POINTS"):
        opened(tmp_path / "a.vtk", VTK_GRID.replace("UNSTRUCTURED_GRID", "STRUCTURED_POINTS"))


def test_triangle_strips_are_not_read(tmp_path):
    with pytest.raises(InputError, match=r"a\.vtk has triangle strips; save it as PLY"):
        opened(tmp_path / "a.vtk", VTK_5.replace("POLYGONS 5 12", "TRIANGLE_STRIPS 5 12"))


@pytest.mark.parametrize("away", [(700, 0, 0), (0, 320, 0), (0, 0, 160)])
def test_two_brains_in_one_file_are_refused_with_their_places(tmp_path, away):
    x, y, z = away
    places = rf"\(0, 0, 0\) and \({x}, {y}, {z}\) um; save the one"
    with pytest.raises(InputError, match="holds two brains or halves of one, centred at " + places):
        open_brain(str(written(tmp_path / "a.ply", together(box(), box(center=away)))))


def test_optic_lobes_that_hang_on_nothing_are_no_second_brain(tmp_path):
    lobe = (170.0, 230.0, 110.0)
    brain = together(box((290, 260, 130)), box(lobe, (250, 0, 0)), box(lobe, (-250, 0, 0)))
    assert open_brain(str(written(tmp_path / "a.ply", brain))).unit == "um"


def test_a_shell_inside_a_shell_is_no_second_brain(tmp_path):
    shells = together(box(), inside_out(box(tuple(0.95 * edge for edge in BRAIN_SIZE))))
    assert open_brain(str(written(tmp_path / "a.ply", shells))).unit == "um"
