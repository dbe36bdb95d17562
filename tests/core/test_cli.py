"""What users script against: the commands, their files, JSON, exit status and sentences."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from flyreg_core.brain_files import open_brain, read_brain, write_mesh
from flyreg_core.cli import main
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.project_file import load_project
from tests.core.conftest import COARSE
from tests.shapes import sphere, together

DONE, WRONG_USAGE, BAD_INPUT, INTERNAL_ERROR = 0, 2, 3, 4


def printed(capsys: pytest.CaptureFixture[str]) -> Any:
    """Return the one JSON object on stdout."""
    return json.loads(capsys.readouterr().out)


def report_of(folder: Path) -> Any:
    return json.loads((folder / "report.json").read_text())


def without_cost(report: dict[str, Any]) -> dict[str, Any]:
    return {k: v for k, v in report.items() if k not in ("seconds", "peak_memory_mb")}


def test_register_writes_mesh_project_and_report(registered: Path) -> None:
    names = sorted(path.name for path in registered.iterdir())
    assert names == [
        "flat.npz",
        "project.flyreg",
        "registered.ply",
        "report.html",
        "report.json",
        "vertex-pairs.csv",
    ]


def test_the_report_has_all_that_scripts_read(registered: Path) -> None:
    report = report_of(registered)
    assert {"name", "sha256", "unit", "vertices"} <= report["source"].keys()
    assert report["halves"].keys() == {"anterior", "posterior"}
    for half in report["halves"].values():
        assert half["triangles"] > 1000
        assert half["flipped_before_spline"] == half["flipped_after_spline"] == 0
        assert half["gap_um"] >= 0
    assert report["landmarks"].keys() == {"boundary", "automatic", "user"}
    for direction in ("source_to_target", "target_to_source"):
        assert {"mean_um", "rms_um", "hausdorff_um"} <= report["distance"][direction].keys()
    assert {"flyreg", "python", "numpy"} <= report["versions"].keys()
    assert report["seconds"]["total"] >= sum(report["seconds"]["by_stage"].values()) * 0.9
    assert isinstance(report["warnings"], list)


def test_another_program_can_check_that_nothing_folds(registered: Path) -> None:
    """By rational numbers: every signed area is positive, and they add up to the strip's."""
    flat, report = np.load(registered / "flat.npz"), report_of(registered)
    for half in ("anterior", "posterior"):
        corners = flat[f"{half}_registered_uv"][flat[f"{half}_faces"]]
        corners[..., 0] += flat[f"{half}_corner_shifts"]
        total = Fraction(0)
        for triangle in corners.tolist():
            (ax, ay), (bx, by), (cx, cy) = (map(Fraction, place) for place in triangle)
            area = ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / 2
            assert area > 0
            total += area
        assert float(total) == pytest.approx(1, abs=1e-9)
        certificate = report["halves"][half]["certificate"]
        assert certificate["not_positive"] == 0
        assert certificate["sum_of_signed_areas"] == pytest.approx(float(total), abs=1e-12)


def test_the_report_tells_how_well_each_landmark_is_foretold(registered: Path) -> None:
    report = report_of(registered)
    assert len(report["landmark_list"]) == sum(report["landmarks"].values())
    assert report["landmarks"]["automatic"] > 50
    for mark in report["landmark_list"]:
        assert mark["residual_um"] >= 0
        assert mark["leave_one_out_um"] >= 0
    curve = report["smoothing_by_cross_validation"]
    assert curve["best"] == curve["smoothings"][int(np.argmin(curve["scores"]))]


def test_the_report_tells_what_the_residual_costs_in_bending_for_each_smoothing(
    with_options: Path,
) -> None:
    report = report_of(with_options)
    curve = report["residual_against_bending"]
    assert curve["smoothings"] == report["smoothing_by_cross_validation"]["smoothings"]
    residuals, energies = curve["residuals_rms_um"], curve["bending_energies"]
    assert residuals[0] < curve["residual_rms_um"] < residuals[-1]
    assert energies[0] > curve["bending_energy"] > energies[-1]


def test_the_report_tells_how_the_halves_meet(registered: Path) -> None:
    seam = report_of(registered)["seam"]
    for surface in ("registered", "target"):
        angle = seam["angle"][surface]
        assert 0 <= angle["mean_degrees"] <= angle["max_degrees"] <= 180
        assert angle["p95_degrees"] <= angle["max_degrees"]
    for way in ("source_to_target", "target_to_source"):
        away = seam["hole_curve"][way]
        assert 0 < away["mean_um"] <= away["max_um"] < 5


def test_the_registered_mesh_is_closed_and_carries_its_properties(registered: Path) -> None:
    mesh = trimesh.load_mesh(registered / "registered.ply", process=False)
    assert mesh.is_watertight
    header = (registered / "registered.ply").read_bytes()[:1000].decode("latin1")
    for name in ("displacement_um", "weight_influence", "status"):
        assert name in header


def test_the_same_command_and_the_saved_project_give_the_same_bytes(
    registered: Path, demo_files: tuple[Path, Path], tmp_path: Path
) -> None:
    again = [*map(str, demo_files), "-o", str(tmp_path / "again"), *COARSE]
    assert main(["register", *again]) == DONE
    repeated = ["--project", str(registered / "project.flyreg"), "-o", str(tmp_path / "repeated")]
    assert main(["register", *repeated]) == DONE
    first = (registered / "registered.ply").read_bytes()
    for folder in ("again", "repeated"):
        is_same = (tmp_path / folder / "registered.ply").read_bytes() == first
        assert is_same
        assert without_cost(report_of(tmp_path / folder)) == without_cost(report_of(registered))


@pytest.fixture(scope="module")
def with_options(
    registered: Path, demo_files: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """The folder that `flyreg register` wrote with options, and a landmark from a file."""
    folder = tmp_path_factory.mktemp("options")
    mesh = read_brain(open_brain(str(registered / "registered.ply")))
    front = int(np.argmin(mesh.vertices[:, 2]))
    table = folder / "landmarks.csv"
    place = ",".join(f'"{x}"' for x in [*mesh.vertices[front], *mesh.vertices[front]])
    table.write_text(f'"Pt-0","true",{place}\n')
    options = ["--pairing", "nearest", "--smoothing", "0.5", "--smoothing-passes", "20"]
    options += ["--flattening-passes", "500", "--landmarks", str(table)]
    assert main(["register", *map(str, demo_files), "-o", str(folder), *COARSE, *options]) == DONE
    return folder


def test_options_of_register_are_kept_in_the_project(with_options: Path) -> None:
    project = load_project(with_options / "project.flyreg")
    assert project.boundary.pairing == "nearest"
    assert project.smoothing == 0.5
    assert [brain.smooth.passes for brain in (project.source, project.target)] == [20, 20]
    assert project.target.flatten.passes == 500


def test_landmarks_from_a_file_act_in_the_units_of_their_brains(
    registered: Path, with_options: Path
) -> None:
    assert report_of(with_options)["landmarks"]["user"] == 1
    assert load_project(registered / "project.flyreg").source.input.unit == "um"


def test_prepare_writes_a_torus(
    demo_files: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "new" / "main.ply"
    assert main(["prepare", str(demo_files[0]), "-o", str(output), *COARSE, "--json"]) == DONE
    facts = printed(capsys)
    mesh = trimesh.load_mesh(output, process=False)
    assert mesh.is_watertight
    assert mesh.euler_number == 0
    assert len(mesh.split(only_watertight=False)) == 1
    assert facts["genus"] == 1
    assert facts["watertight"] is True
    assert facts["vertices"] == len(mesh.vertices)
    assert {"mean_um", "p99_um", "max_um"} <= facts["deviation"].keys()
    assert {"center_um", "width_um", "chosen_by"} <= facts["handle"].keys()
    assert {"filled_um3", "seconds", "peak_memory_mb", "diagonal_um"} <= facts.keys()


def test_prepare_keeps_about_the_vertices_asked_for_and_warns_when_these_are_few(
    demo_files: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["prepare", str(demo_files[0]), "-o", str(tmp_path / "m.ply"), *COARSE]
    assert main([*arguments, "--vertices", "4000", "--json"]) == DONE
    captured = capsys.readouterr()
    facts = json.loads(captured.out)
    assert 3000 <= facts["vertices"] <= 4000
    assert facts["genus"] == 1
    assert "fewer than 10000" in captured.err


def test_inspect_says_what_a_brain_is(
    demo_files: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["inspect", str(demo_files[0]), *COARSE, "--json"]) == DONE
    facts = printed(capsys)
    assert facts["kind"] == "surface"
    assert facts["unit"] == "um"
    assert facts["unit_known_by"] == "judged from the size"
    assert facts["components"] == 1
    assert facts["genus"] == 1
    assert facts["open_edges"] == facts["non_manifold_edges"] == 0
    assert len(facts["extent_um"]) == 3
    assert [handle["is_oesophagus"] for handle in facts["handles"]].count(True) == 1


def test_distance_of_a_surface_from_itself_is_zero(
    demo_files: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["distance", str(demo_files[0]), str(demo_files[0]), "--json"]) == DONE
    facts = printed(capsys)
    for direction in ("a_to_b", "b_to_a"):
        assert facts[direction]["hausdorff_um"] <= 1e-5


def test_distances_are_told_with_their_error_and_in_voxels_of_a_stated_size(
    demo_files: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    pair = [*map(str, demo_files), "--json"]
    assert main(["distance", *pair, "--voxel-size", "0.5", "0.5", "4"]) == DONE
    facts = printed(capsys)
    assert facts["voxel_edge_um"] == pytest.approx(1.0)
    for direction in ("a_to_b", "b_to_a"):
        told = facts[direction]
        assert told["p50_um"] <= told["p95_um"] <= told["p99_um"] <= told["hausdorff_um"]
        assert 0 < told["standard_error_um"] < 0.01 * told["mean_um"]
        for name in ("mean", "rms", "hausdorff", "p95"):
            assert told[f"{name}_voxels"] == pytest.approx(told[f"{name}_um"])
            share = told[f"{name}_um"] / facts["diagonal_um"]
            assert told[f"{name}_share_of_diagonal"] == pytest.approx(share)
    assert main(["distance", *pair]) == DONE
    facts = printed(capsys)
    assert facts["voxel_edge_um"] is None
    assert "mean_voxels" not in facts["a_to_b"]
    assert main(["distance", *pair, "--voxel-size", "0", "1", "1"]) == BAD_INPUT
    assert "positive edges in micrometres, not 0 x 1 x 1" in capsys.readouterr().err


def test_facts_for_people_are_lines_of_text(
    demo_files: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["distance", str(demo_files[0]), str(demo_files[1])]) == DONE
    assert "a_to_b:\n  mean_um: " in capsys.readouterr().out


@pytest.mark.usefixtures("brains_known")
def test_transform_carries_vertices_where_registration_put_them(
    registered: Path, tmp_path: Path
) -> None:
    start = read_brain(load_project(registered / "project.flyreg").source.input)
    chosen = start.vertices[:: len(start.vertices) // 200]
    rows = [f"{i},{x!r},{y!r},{z!r}" for i, (x, y, z) in enumerate(chosen.tolist())]
    table, out, back = tmp_path / "in.csv", tmp_path / "out.csv", tmp_path / "back.csv"
    table.write_text("\n".join(["name,x,y,z", *rows, "far,9999,0,0"]) + "\n")
    project = str(registered / "project.flyreg")
    assert main(["transform", project, str(table), "-o", str(out)]) == DONE
    lines = out.read_text().splitlines()
    assert lines[0] == "x,y,z,name,status"
    assert len(lines) == len(rows) + 2
    assert lines[-1] == ",,,far,outside"
    assert sum(line.endswith(",mapped") for line in lines) > 50
    kept = [line for line in lines if not line.endswith("outside")]
    out.write_text("\n".join(kept) + "\n")
    assert main(["transform", project, str(out), "-o", str(back), "--inverse"]) == DONE
    returned = [line.split(",") for line in back.read_text().splitlines()[1:]]
    away = [
        np.linalg.norm(np.array(cells[:3], float) - chosen[int(cells[3])])
        for cells in returned
        if cells[-1] == "mapped"
    ]
    assert len(away) > 50
    assert np.median(away) < 0.5


def bad_brain(kind: str, folder: Path) -> str:
    """Write a brain that cannot be registered; return its path."""
    path = folder / f"{kind}.ply"
    if kind == "empty":
        path.write_bytes(b"")
    elif kind == "text":
        path.write_text("not a mesh")
    elif kind == "tiny":
        write_mesh(path, SurfaceMesh(*sphere(1e-3)), "um")
    elif kind == "two":
        left, right = sphere(200.0), sphere(200.0)
        far = (right[0] + [900.0, 0, 0], right[1])
        write_mesh(path, SurfaceMesh(*together(left, far)), "um")
    elif kind == "ball":
        vertices, faces = sphere(100.0, 4)
        write_mesh(path, SurfaceMesh(vertices * [3, 1.5, 0.7], faces), "um")
    elif kind == "round":
        write_mesh(path, SurfaceMesh(*sphere(150.0, 4)), "um")
    return str(path)


@pytest.mark.parametrize(
    ("kind", "sentence"),
    [
        ("missing", "missing.ply"),
        ("empty", "empty"),
        ("text", "text.ply"),
        ("tiny", "unit"),
        ("two", "two brains"),
        ("ball", "without a front and a top"),
        ("round", "no direction that is clearly its left and right"),
    ],
)
def test_a_brain_that_cannot_be_used_gets_one_sentence_and_writes_nothing(
    kind: str, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    brain = bad_brain(kind, tmp_path)
    output = tmp_path / "out" / "main.ply"
    assert main(["prepare", brain, "-o", str(output), *COARSE]) == BAD_INPUT
    error = capsys.readouterr().err
    said = [line for line in error.splitlines() if "judged from the size" not in line]
    assert len(said) == 1
    assert sentence in said[0]
    assert "Traceback" not in error
    assert not output.exists()


Arguments = Callable[[Path, Path, Path], list[str]]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (lambda s, t, o: ["register", str(s), "-o", str(o)], "give both a source and a target"),
        (
            lambda s, t, o: ["register", str(s), str(t), "-o", str(o), "--smoothing", "-1"],
            "smoothing must be 0 or a positive number",
        ),
        (
            lambda s, t, o: ["register", str(s), str(t), "-o", str(o), "--smoothing", "nan"],
            "smoothing must be 0 or a positive number",
        ),
        (lambda s, t, o: ["prepare", str(s), "-o", str(o / "a.xyz")], "cannot be written as .xyz"),
        (
            lambda s, t, o: ["prepare", str(s), "-o", str(o / "a.ply"), "--trim-right", "99999"],
            "move the planes",
        ),
        (
            lambda s, t, o: ["prepare", str(s), "-o", str(o / "a.ply"), "--vertices", "5"],
            "5 vertices cannot describe a brain",
        ),
        (
            lambda s, t, o: ["prepare", str(s), "-o", str(o / "a.ply"), "--voxels", "0"],
            "voxels",
        ),
        (lambda s, t, o: ["prepare", str(s), "-o", str(s.parent)], "cannot be written"),
        (
            lambda s, t, o: ["prepare", str(s), "-o", str(s / "a.ply")],
            "is a file, not a folder",
        ),
        (
            lambda s, t, o: ["register", "--project", str(s), "-o", str(o)],
            "source.ply",
        ),
    ],
)
def test_what_cannot_be_done_is_said_in_one_sentence(
    arguments: Arguments,
    sentence: str,
    demo_files: tuple[Path, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    command = arguments(*demo_files, tmp_path / "out")
    assert main(command) == BAD_INPUT
    error = capsys.readouterr().err
    assert sentence in error
    assert "Traceback" not in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("arguments", [[], ["fly"], ["register"], ["prepare", "JFRC2"]])
def test_wrong_usage_ends_with_status_2(arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == WRONG_USAGE


def test_an_internal_error_leaves_a_log_and_no_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def explode(*_: object) -> None:
        raise ZeroDivisionError("of no interest to the user")

    monkeypatch.setattr("flyreg_core.brain_files.open_brain", explode)
    assert main(["inspect", "JFRC2"]) == INTERNAL_ERROR
    error = capsys.readouterr().err
    log = Path(error.strip().split()[-1])
    assert "Traceback" not in error
    assert "of no interest to the user" in log.read_text()
    log.unlink()


def test_the_command_imports_nothing_heavy_to_print_its_help() -> None:
    code = (
        "import sys, flyreg_core.cli as c\n"
        "try: c.main(['--help'])\n"
        "except SystemExit: pass\n"
        "print(sorted({'numpy', 'scipy', 'numba', 'trimesh', 'igl'} & set(sys.modules)))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.splitlines()[-1] == "[]"


def test_no_command_imports_qt_or_vtk(demo_files: tuple[Path, Path], tmp_path: Path) -> None:
    code = (
        "import sys, flyreg_core.cli as c\n"
        f"status = c.main(['prepare', {str(demo_files[0])!r}, '-o', {str(tmp_path / 'a.ply')!r},"
        " '--voxels', '24'])\n"
        "print(status, [m for m in sys.modules if m.startswith(('PySide6', 'vtk', 'pyvista'))])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.splitlines()[-1] == "0 []"


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is sent another way on Windows")
def test_ctrl_c_ends_soon_and_leaves_no_file(demo_files: tuple[Path, Path], tmp_path: Path) -> None:
    output = tmp_path / "out"
    # a shell that runs the tests in the background has its programs ignore Ctrl-C
    code = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "import flyreg_core.pipeline; from flyreg_core.cli import main\n"
        "print('ready', flush=True); sys.exit(main(sys.argv[1:]))"
    )
    command = [sys.executable, "-c", code, "register", *map(str, demo_files)]
    process = subprocess.Popen(
        [*command, "-o", str(output), "--voxels", "110"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    assert process.stdout is not None
    process.stdout.readline()  # it may take long until it can begin
    time.sleep(2)  # somewhere in the middle of its work
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=20)
    assert process.returncode == 130
    assert "Traceback" not in error
    assert not output.exists()
