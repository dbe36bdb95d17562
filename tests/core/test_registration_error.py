"""The target registration error of a report is that of points carried by `flyreg transform`."""

from __future__ import annotations

import csv
import json
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from flyreg_core.brain_files import open_brain, read_brain
from flyreg_core.cli import main

pytestmark = pytest.mark.usefixtures("brains_known")

DONE, BAD_INPUT = 0, 3
TARGET_AXES = ("x_target", "y_target", "z_target")


@pytest.fixture(scope="module")
def truth(demo_files: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Vertices of the demo pair, which correspond, in nanometres; two are far from the brain."""
    source, target = (read_brain(open_brain(str(path))).vertices for path in demo_files)
    rows = 1000 * np.hstack([source, target])[:: len(source) // 150]
    path = tmp_path_factory.mktemp("truth") / "truth.csv"
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["x", "y", "z", *TARGET_AXES])
        writer.writerows([*rows.tolist(), [9e6] * 6, [-9e6] * 6])
    return path


class Figures(HTMLParser):
    """The figures on a page by the keys of the facts that they show."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.by_key: dict[str, str | None] = {}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        if tag == "data":
            self.by_key[str(found["data-key"])] = found["value"]


def test_page_and_json_tell_what_carrying_the_points_by_the_command_comes_to(
    registered: Path, truth: Path, tmp_path: Path
) -> None:
    project, folder, carried = registered / "project.flyreg", tmp_path / "run", tmp_path / "out.csv"
    points = ["--points", str(truth), "--unit", "nm"]
    assert main(["register", "--project", str(project), "-o", str(folder), *points]) == DONE
    told = json.loads((folder / "report.json").read_text())["target_registration_error"]
    page = Figures((folder / "report.html").read_text(encoding="utf-8")).by_key
    for name, value in told.items():
        assert page[f"target_registration_error.{name}"] == json.dumps(value)

    command = ["transform", str(project), str(truth), "--unit", "nm", "-o", str(carried)]
    assert main(command) == DONE
    errors, unmapped = [], 0
    with carried.open(newline="") as stream:
        for row in csv.DictReader(stream):
            if row["status"] == "mapped":
                end, there = (
                    [float(row[a]) for a in axes] for axes in (("x", "y", "z"), TARGET_AXES)
                )
                errors.append(np.linalg.norm(np.subtract(end, there)) / 1000)
            else:
                unmapped += 1
    assert unmapped >= 2
    assert told == {
        "points": len(errors) + unmapped,
        "unmapped": unmapped,
        "mean_um": pytest.approx(np.mean(errors)),
        "median_um": pytest.approx(np.median(errors)),
        "p95_um": pytest.approx(np.percentile(errors, 95)),
    }


def test_points_none_of_which_is_near_the_brain_leave_the_figures_unknown(
    registered: Path, tmp_path: Path
) -> None:
    far = tmp_path / "far.csv"
    far.write_text("x,y,z,x_target,y_target,z_target\n9000,0,0,0,0,0\n")
    folder = tmp_path / "run"
    command = ["register", "--project", str(registered / "project.flyreg"), "-o", str(folder)]
    assert main([*command, "--points", str(far)]) == DONE
    told = json.loads((folder / "report.json").read_text())["target_registration_error"]
    nothing = dict.fromkeys(("mean_um", "median_um", "p95_um"))
    assert told == {"points": 1, "unmapped": 1, **nothing}


def test_points_that_cannot_be_read_are_said_before_anything_is_registered(
    registered: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "run"
    command = ["register", "--project", str(registered / "project.flyreg"), "-o", str(folder)]
    assert main([*command, "--points", str(tmp_path / "none.csv")]) == BAD_INPUT
    assert "none.csv" in capsys.readouterr().err
    assert not folder.exists()
