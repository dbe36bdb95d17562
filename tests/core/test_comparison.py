"""flyreg beside other methods: the command, its sentences, and what its figures mean."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import redirect_stdout, suppress
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import psutil
import pytest
from PIL import Image

from flyreg_core.affine import AffineMap
from flyreg_core.apart import STARTED, Limits, run_apart
from flyreg_core.brain_files import open_brain, read_brain, write_mesh
from flyreg_core.cli import main
from flyreg_core.comparison import (
    METHODS,
    TITLES,
    MovedSource,
    Rivalling,
    find_methods,
    folded_share,
)
from flyreg_core.comparison_report import as_table
from flyreg_core.errors import Cancelled, FlyregError
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.point_files import read_point_pairs
from flyreg_core.progress import ignore
from tests.shapes import sphere

T = TypeVar("T")

DONE, WRONG_USAGE, BAD_INPUT = 0, 2, 3
LONG_SECONDS, POLL_SECONDS = 180.0, 0.05
COARSE = ["--voxels", "32"]
FILES = ("compare.png", "compare.json", "compare.csv", "compare.html")
ROW_KEYS = {
    *("method", "seconds", "peak_memory_mb", "mean_um", "rms_um", "tre_mean_um", "tre_p95_um"),
    *("folded_share", "source_to_target", "target_to_source", "status"),
}


def task(name: str) -> Rivalling:
    ball = SurfaceMesh(*sphere(100.0, 3))
    larger = SurfaceMesh(1.1 * ball.vertices, ball.faces)
    still = AffineMap(np.eye(3), np.zeros(3))
    return Rivalling(name, ball, larger, still, ball.vertices[:5])


@pytest.fixture(scope="module")
def truth(demo_files: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Points of the demo pair, whose vertices correspond; the last is far from both brains."""
    source, target = (read_brain(open_brain(str(path))).vertices for path in demo_files)
    rows = [[*source[k], *target[k]] for k in range(0, len(source), len(source) // 200)]
    rows = [row for row in rows if abs(row[0] - source[:, 0].mean()) < 80]
    path = tmp_path_factory.mktemp("truth") / "truth.csv"
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["x", "y", "z", "x_target", "y_target", "z_target"])
        writer.writerows([*rows, [5000.0] * 6])
    return path


@pytest.fixture(scope="module")
def compared(
    demo_files: tuple[Path, Path], truth: Path, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """The folder that `flyreg compare` wrote for the demo pair, with stdout in it.

    One rival's package is missing, another takes too long.
    """
    folder, modules = tmp_path_factory.mktemp("comparison"), tmp_path_factory.mktemp("modules")
    (modules / "small_gicp.py").write_text("raise ModuleNotFoundError('no', name='small_gicp')\n")
    options = ["--methods", "none,alignment,icp-plane,nricp,flyreg", "--points", str(truth)]
    options += ["--time-limit", "1.5", "--json", "-o", str(folder)]
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(io.StringIO()) as out:
        places = [str(modules), *filter(None, sys.path)]
        patch.setenv("PYTHONPATH", os.pathsep.join(places))
        assert main(["compare", *map(str, demo_files), *COARSE, *options]) == DONE
    (folder / "stdout").write_text(out.getvalue())
    return folder


def facts_of(folder: Path) -> Any:
    return json.loads((folder / "compare.json").read_text())


def rows_of(folder: Path) -> dict[str, Any]:
    return {row["method"]: row for row in facts_of(folder)["rows"]}


def test_the_comparison_has_all_that_scripts_read(compared: Path) -> None:
    rows = rows_of(compared)
    assert list(rows) == ["none", "alignment", "icp-plane", "nricp", "flyreg"]
    assert all(row.keys() >= ROW_KEYS for row in rows.values())
    for name in ("none", "alignment", "flyreg"):
        assert rows[name]["status"] == "done"
        assert 0 <= rows[name]["folded_share"] < 0.01
        assert rows[name]["peak_memory_mb"] > 10
        for direction in ("source_to_target", "target_to_source"):
            assert {"mean_um", "rms_um", "hausdorff_um"} <= rows[name][direction].keys()
    facts = facts_of(compared)
    assert facts["points_outside"] == 1
    assert 0 < facts["preparation_seconds"] < rows["flyreg"]["seconds"]
    assert json.loads((compared / "stdout").read_text()) == facts


def test_each_method_does_better_than_those_that_may_move_less(compared: Path) -> None:
    rows = rows_of(compared)
    for measure in ("mean_um", "rms_um", "tre_mean_um", "tre_p95_um"):
        assert rows["none"][measure] > rows["alignment"][measure] > rows["flyreg"][measure]
    assert rows["none"]["folded_share"] == rows["alignment"]["folded_share"] == 0


def test_a_rival_that_cannot_is_a_row_that_says_why(compared: Path) -> None:
    rows = rows_of(compared)
    missing, slow = rows["icp-plane"], rows["nricp"]
    assert missing["status"] == "needs the package small_gicp; install flyreg[rivals] to have it"
    assert slow["status"] == "took longer than 1.5 s and was ended"
    assert slow["mean_um"] is slow["seconds"] is slow["source_to_target"] is None
    table = as_table(facts_of(compared)).splitlines()
    assert [line.split()[0] for line in table[1:6]] == list(rows)
    assert table[3] == f"icp-plane  {missing['status']}"
    assert f"{rows['flyreg']['mean_um']:.3f}" in table[5]
    assert not any("--points" in line for line in table)  # there are points


def test_without_points_it_is_said_how_to_have_the_registration_error(compared: Path) -> None:
    facts = facts_of(compared)
    for row in facts["rows"]:
        row["tre_mean_um"] = row["tre_p95_um"] = None
    assert "--points" in as_table(facts).splitlines()[-1]


def test_meshes_pictures_and_tables_are_written(compared: Path) -> None:
    names = {path.name for path in compared.iterdir()} - {"stdout"}
    done = ("none", "alignment", "flyreg")
    expected = {f"{method}.{kind}" for method in done for kind in ("ply", "png")}
    assert names == expected | {"target.png", *FILES}
    with (compared / "compare.csv").open(newline="") as stream:
        table = {row["method"]: row for row in csv.DictReader(stream)}
    for method, row in rows_of(compared).items():
        assert table[method]["source_to_target_rms_um"] == str(row["rms_um"] or "")


def test_the_page_shows_the_figures_of_the_json_and_what_could_not_be_done(compared: Path) -> None:
    page, facts = (compared / "compare.html").read_text(encoding="utf-8"), facts_of(compared)
    told = {k: v for v, k in re.findall(r'<data value="([^"]*)" data-key="rows\.([^"]*)"', page)}
    for number, row in enumerate(facts["rows"]):
        if row["status"] != "done":
            assert row["status"] in page
        else:
            assert told[f"{number}.tre_mean_um"] == str(row["tre_mean_um"])
            assert told[f"{number}.source_to_target.mean_um"] == str(row["mean_um"])
    for row in facts["rows"]:  # people read titles; the names are in commands and files
        assert f">{TITLES[row['method']]}</td>" in page
        assert f"<code>{row['method']}</code>" in page
    assert page.count("data:image/webp;base64,") == 4
    assert "http" not in page


def test_a_rival_that_needs_too_much_memory_is_ended() -> None:
    done = run_apart(task("none"), Limits(megabytes=10), ignore, "")
    assert not done.is_done
    assert done.sentence == "needed more than 10 MB of memory and was ended"


@pytest.mark.parametrize("option", ["--time-limit", "--memory-limit"])
@pytest.mark.parametrize("value", ["0", "-1", "nan"])
def test_a_limit_that_nothing_can_keep_is_said(
    option: str, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["compare", "FCWB", "JFRC2", f"{option}={value}"]) == BAD_INPUT
    assert f"not {value}\n" in capsys.readouterr().err


def test_a_rival_that_fails_says_how() -> None:
    done = run_apart(task("no such"), Limits(), ignore, "")
    assert done.sentence == "failed: KeyError: 'no such'"


def test_a_rival_run_apart_comes_to_the_same_as_here() -> None:
    there, here = (
        run_apart(task("icp-similarity"), Limits(), ignore, ""),
        task("icp-similarity").run(),
    )
    assert isinstance(there.value, MovedSource)
    assert np.array_equal(there.value.vertices, here.vertices)
    assert np.array_equal(there.value.points, here.points)


def test_pictures_have_no_ground_of_their_own_and_fit_light_and_dark_pages(compared: Path) -> None:
    for name in ("target", "flyreg"):
        picture = np.asarray(Image.open(compared / f"{name}.png"))
        assert picture.shape[2] == 4
        assert (picture[0, :, 3] == 0).all()
        assert (picture[..., 3] == 255).mean() > 0.1
    sheet = np.asarray(Image.open(compared / "compare.png"))  # with dark names on it
    assert sheet.shape[2] == 3


def test_a_report_that_cancels_leaves_no_process() -> None:
    def cancel(fraction: float, text: str) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        run_apart(task("cpd-nonrigid"), Limits(), cancel, "")
    assert not psutil.Process().children()


def workers_of(program: subprocess.Popen[Any]) -> list[psutil.Process]:
    """Return what works apart for a program.

    Not by `children`, which sees none that the clock, set back meanwhile, makes older than it is.
    """
    found = []
    for process in psutil.process_iter():
        with suppress(psutil.Error):
            if process.ppid() == program.pid and "flyreg_core.apart" in process.cmdline():
                found.append(process)
    return found


def awaited(look: Callable[[], T], program: subprocess.Popen[Any]) -> T:
    """Return what is seen in the end; the program must live until then."""
    for _ in range(round(LONG_SECONDS / POLL_SECONDS)):
        if found := look():
            return found
        assert program.poll() is None, "the program ended by itself"
        time.sleep(POLL_SECONDS)
    raise AssertionError(f"nothing to see after {LONG_SECONDS:g} s")


def test_a_worker_whose_parent_is_killed_ends_too_and_leaves_no_folder() -> None:
    program = (
        "from flyreg_core.apart import Limits, run_apart\n"
        "from flyreg_core.progress import ignore\n"
        "from tests.core.test_comparison import task\n"
        "run_apart(task('cpd-nonrigid'), Limits(), ignore, '')"
    )
    places = os.pathsep.join(filter(None, sys.path))
    parent = subprocess.Popen(
        [sys.executable, "-c", program], env={**os.environ, "PYTHONPATH": places}
    )
    (worker,) = awaited(lambda: workers_of(parent), parent)
    folder = Path(worker.cmdline()[-1])
    awaited((folder / STARTED).exists, parent)
    parent.kill()
    parent.wait()
    _, alive = psutil.wait_procs([worker], timeout=10)
    assert not alive
    assert not folder.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is sent another way on Windows")
def test_ctrl_c_ends_a_comparison_and_its_processes_at_once(
    demo_files: tuple[Path, Path], tmp_path: Path
) -> None:
    program = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from flyreg_core.cli import main; sys.exit(main())"
    )
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            program,
            "compare",
            *map(str, demo_files),
            "-o",
            str(tmp_path / "o"),
        ],
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    workers = awaited(lambda: workers_of(process), process)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=10)
    assert process.returncode == 130
    assert "Traceback" not in error
    _, alive = psutil.wait_procs(workers, timeout=10)
    assert not alive
    assert not (tmp_path / "o").exists()


def test_a_family_of_methods_goes_by_its_first_name() -> None:
    assert find_methods(["flyreg", "cpd"]) == (
        *("cpd-rigid", "cpd-affine", "cpd-nonrigid", "cpd-low-rank", "flyreg"),
    )
    with pytest.raises(FlyregError, match="there is no method magic; there are none, alignment"):
        find_methods(["none", "magic"])


def test_a_method_that_does_not_exist_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["compare", "a.ply", "b.ply", "--methods", "icp,magic"])
    assert stopped.value.code == WRONG_USAGE
    assert "there is no method magic" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            "x,y,z\n1,2,3\n",
            "has no columns x, y, z, x_target, y_target, z_target, and is no landmark",
        ),
        ("x,y,z,x_target,y_target,z_target\n", "holds no point with a place in both brains"),
        (
            "x,y,z,x_target,y_target,z_target\n1,2,3,4,5,\n",
            "row 1, column z_target: '' is not a number",
        ),
        ("x,y,z,x_target,y_target,z_target\n1,2,3,4,5\n", "row 1: 5 values for 6 columns"),
        ("x,y,x_target,y_target,z_target\n1,2,3,4,5\n", "has no column z in its first line"),
        ("1,2,3,4,5,six\n", '"six" is not a number'),
    ],
)
def test_a_truth_that_cannot_be_read_is_said(
    demo_files: tuple[Path, Path],
    text: str,
    sentence: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "truth.csv"
    path.write_text(text)
    assert main(["compare", *map(str, demo_files), "--points", str(path)]) == BAD_INPUT
    assert sentence in capsys.readouterr().err


def test_a_truth_may_be_a_landmark_file_of_six_columns(tmp_path: Path) -> None:
    path = tmp_path / "landmarks.csv"
    path.write_text("x_a,y_a,z_a,x_b,y_b,z_b\n1,2,3,4,5,6\n7,8,9,10,11,12\n")
    pairs = read_point_pairs(path).scaled(0.001, 1.0)
    assert np.allclose(pairs.source, [[0.001, 0.002, 0.003], [0.007, 0.008, 0.009]])
    assert np.array_equal(pairs.target, [[4, 5, 6], [10, 11, 12]])


def test_brains_that_cannot_be_registered_end_the_comparison_with_their_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ball = tmp_path / "ball.ply"
    write_mesh(ball, SurfaceMesh(*sphere(200.0, 3)), "um")
    assert main(["compare", str(ball), str(ball), "--methods", "none"]) == BAD_INPUT
    assert "look like a brain" in capsys.readouterr().err


def test_an_affine_movement_never_folds_even_one_that_mirrors() -> None:
    ball, other = SurfaceMesh(*sphere(100.0, 3)), SurfaceMesh(*sphere(20.0, 2))
    matrix = np.array([[-1.5, 0.4, 0], [0, 0.7, 0.2], [0.1, 0, 1.1]])
    moved = SurfaceMesh(ball.vertices @ matrix.T, ball.faces[:, ::-1])
    assert folded_share(ball, moved, other) == 0


def test_faces_that_are_folded_over_are_counted() -> None:
    """The cap above 85 um is exchanged left for right, so its faces lie on the ball inside out."""
    ball = SurfaceMesh(*sphere(100.0, 4))
    vertices = ball.vertices.copy()
    is_cap = vertices[:, 2] > 85
    vertices[is_cap, 0] *= -1
    wholly, partly = is_cap[ball.faces].all(axis=1), is_cap[ball.faces].any(axis=1)
    share = folded_share(ball, SurfaceMesh(vertices, ball.faces), ball)
    whole = ball.face_areas.sum()
    low, high = (ball.face_areas[chosen].sum() / whole for chosen in (wholly, partly))
    assert 0 < low <= share <= high


def test_all_methods_of_the_papers_table_are_there() -> None:
    families = {name.partition("-")[0] for name in METHODS}
    assert {"none", "icp", "ndt", "cpd", "nricp", "flyreg"} <= families
