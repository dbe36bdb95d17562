"""report.html: one page without other files, whose figures are those of report.json."""

from __future__ import annotations

import base64
import copy
import io
import json
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from flyreg_core.report_page import looked_up, render

MOST_BYTES = 5_000_000
LOADS = ("src", "href", "srcset", "data", "action", "poster", "background", "xlink:href")


class Page(HTMLParser):
    """What a page is made of."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.figures: list[tuple[str, str, str]] = []  # key, value, what is shown
        self.words, self._open = "", ""
        self._figure: tuple[str, str] | None = None
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.tags.append((tag, found))
        self._open = tag
        if tag == "data":
            self._figure = str(found["data-key"]), str(found["value"])

    def handle_endtag(self, tag: str) -> None:
        self._open = ""

    def handle_data(self, data: str) -> None:
        if self._figure is not None:
            self.figures.append((*self._figure, data))
            self._figure = None
        if self._open != "style":
            self.words += data

    def attributes(self, tag: str, name: str) -> list[str]:
        return [found[name] or "" for own, found in self.tags if own == tag and name in found]


def text_of(folder: Path) -> str:
    return (folder / "report.html").read_text(encoding="utf-8")


def facts_of(folder: Path) -> Any:
    return json.loads((folder / "report.json").read_text())


@pytest.fixture(scope="module")
def page(registered: Path) -> Page:
    return Page(text_of(registered))


def test_the_page_needs_no_other_file_and_no_network(registered: Path, page: Page) -> None:
    for tag, attributes in page.tags:
        assert tag not in ("script", "link", "iframe", "object", "embed", "base")
        for name in LOADS:
            if (value := attributes.get(name)) is not None and tag != "data":
                assert value.startswith("data:image/")
        assert not [name for name in attributes if name.startswith("on")]
    style = text_of(registered).split("<style>")[1].split("</style>")[0]
    assert "url(" not in style
    assert "@import" not in style


def test_the_page_is_small(registered: Path) -> None:
    assert (registered / "report.html").stat().st_size < MOST_BYTES


def test_each_figure_on_the_page_is_that_of_the_json_file(registered: Path, page: Page) -> None:
    facts = facts_of(registered)
    assert len(page.figures) > 100
    for key, value, shown in page.figures:
        known = looked_up(facts, key)
        assert json.loads(value) == known
        if not isinstance(known, bool):
            assert float(shown.split()[0]) == pytest.approx(known, rel=0.006, abs=1e-300)


def test_the_page_tells_all_that_a_reader_needs(registered: Path, page: Page) -> None:
    facts = facts_of(registered)
    keys = {key for key, _, _ in page.figures}
    for way in ("source_to_target", "target_to_source"):
        for name in ("mean", "rms", "p50", "p95", "p99", "hausdorff", "standard_error"):
            assert f"distance.{way}.{name}_um" in keys
    for half in ("anterior", "posterior"):
        for name in ("flipped_after_spline", "flipped_by_spline_and_mended", "gap_um"):
            assert f"halves.{half}.{name}" in keys
    for number in range(len(facts["landmark_list"])):
        for name in ("weight", "residual_um", "leave_one_out_um"):
            assert f"landmark_list.{number}.{name}" in keys
    for row in ("angle.registered", "angle.target"):
        assert f"seam.{row}.mean_degrees" in keys
    assert "seam.hole_curve.source_to_target.max_um" in keys
    assert {"there_and_back_um.mean", "smoothing", "seconds.total"} <= keys
    assert {
        f"residual_against_bending.{name}" for name in ("residual_rms_um", "bending_energy")
    } <= keys
    for brain in (facts["source"], facts["target"]):
        assert brain["sha256"] in page.words
    for version in facts["versions"].values():
        assert version in page.words
    for warning in facts["warnings"]:
        assert warning in page.words
    assert "flyreg register --project project.flyreg -o again" in page.words


def test_the_page_shows_both_brains_before_and_after_flat_and_in_colours(page: Page) -> None:
    captions = page.attributes("img", "alt")
    for title in ("Source", "Target", "Registered", "Before", "After", "Distance", "Displacement"):
        assert len([text for text in captions if text.startswith(title)]) == 3
    assert len([text for text in captions if "half, flat" in text]) == 6
    for uri in page.attributes("img", "src"):
        content = base64.b64decode(uri.split(",", 1)[1])
        picture = np.array(Image.open(io.BytesIO(content)).convert("RGBA"))
        is_shown = picture[..., 3] > 0
        assert 0.2 < is_shown.mean() < 1.0
        assert picture[is_shown][:, :3].std() > 5


def with_names(facts: Any, name: str) -> Any:
    changed = copy.deepcopy(facts)
    changed["source"]["name"] = name
    changed["warnings"] = [f"{name}: odd"]
    changed["landmark_list"][0]["name"] = name
    return changed


@pytest.mark.parametrize(
    "name",
    [
        "<script>alert(1)</script> & 'Mühle' \"x\".ply",
        "</style></title><img src=http://example.org/x.png>",
        "{{ 7 * 7 }}{% raw %}",
        "fly\udc80brain.ply",
    ],
)
def test_odd_names_are_shown_as_they_are(registered: Path, name: str) -> None:
    text = render(with_names(facts_of(registered), name), (), "project.flyreg")
    text.encode("utf-8")
    page = Page(text)
    assert not [tag for tag, _ in page.tags if tag in ("script", "img")]
    shown = name.encode("utf-8", "backslashreplace").decode("utf-8")
    assert page.words.count(shown) >= 3


def test_the_command_is_quoted_for_a_shell(registered: Path) -> None:
    page = Page(render(facts_of(registered), (), "my run; rm -rf.flyreg"))
    assert "--project 'my run; rm -rf.flyreg' -o again" in page.words


def test_a_landmark_whose_id_has_a_dot_is_found(registered: Path) -> None:
    facts = facts_of(registered)
    facts["folds_by_landmark"] = {"Pt-0.5": 3, "Pt-0": 4}
    figures = {key: value for key, value, _ in Page(render(facts, (), "p.flyreg")).figures}
    assert figures["folds_by_landmark.Pt-0.5"] == "3"
    assert figures["folds_by_landmark.Pt-0"] == "4"
    assert looked_up({"a": [{"b": 1}]}, "a.0.b") == 1


def test_what_was_not_measured_is_left_out(registered: Path) -> None:
    facts = facts_of(registered)
    curves = ("smoothing_by_cross_validation", "residual_against_bending")
    for key in ("distance", "there_and_back_um", *curves):
        facts[key] = None
    facts["folds_by_landmark"] = None
    facts["landmark_list"] = [
        {**mark, "residual_um": None, "leave_one_out_um": None} for mark in facts["landmark_list"]
    ]
    page = Page(render(facts, (), "project.flyreg"))
    assert "Not measured." in page.words
    assert not page.attributes("svg", "viewBox")


def test_the_target_registration_error_is_told_where_points_were_given(registered: Path) -> None:
    facts = facts_of(registered)
    assert "Target registration error" not in Page(text_of(registered)).words
    facts["target_registration_error"] = {"points": 77, "mean_um": 4.25, "p95_um": 9.5}
    page = Page(render(facts, (), "project.flyreg"))
    figures = {key: value for key, value, _ in page.figures}
    assert figures["target_registration_error.mean_um"] == "4.25"
    assert figures["target_registration_error.points"] == "77"
    assert "Target registration error" in page.words
