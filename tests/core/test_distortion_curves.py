"""What simplifying and smoothing cost a shape, and the picture of it."""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from flyreg_core.chart import Axis, Band, Line, Mark, Panel, draw_panels
from flyreg_core.cli import BAD_INPUT, DONE, main
from flyreg_core.distortion_curves import (
    PASSES,
    Distortion,
    DistortionCurves,
    draw_curves,
    find_curves,
    settled_from,
    simplification_curve,
    smoothing_curve,
)
from flyreg_core.errors import Cancelled
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.progress import ignore
from flyreg_core.smooth import SmoothParameters, smooth
from flyreg_core.surface_distance import measure_distances
from tests.core.conftest import COARSE
from tests.shapes import sphere, torus

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def surface() -> SurfaceMesh:
    """A torus of more vertices than the paper wants to be kept, with bumps."""
    vertices, faces = torus(around=150, across=80)
    bumps = 2 * np.sin(vertices / 6).prod(axis=1, keepdims=True)
    return SurfaceMesh(vertices * (1 + bumps / 200), faces)


@pytest.fixture(scope="module")
def curves(surface: SurfaceMesh) -> DistortionCurves:
    return find_curves(surface, None, ignore)


def test_fewer_vertices_cost_more(curves: DistortionCurves, surface: SurfaceMesh) -> None:
    points = curves.simplification.points
    assert len(points) > 5
    for fewer, more in pairwise(points):
        assert fewer.vertices < more.vertices
        assert fewer.amount == fewer.vertices / len(surface.vertices)
        assert fewer.mean_distance_um >= 0.9 * more.mean_distance_um  # both are estimates
    assert points[-1].amount == points[-1].area_share == 1.0
    assert points[-1].mean_distance_um == 0.0
    assert points[0].area_share < points[-1].area_share


def test_what_is_recommended_costs_less_than_a_voxel_and_a_hundredth_of_the_area(
    curves: DistortionCurves, surface: SurfaceMesh
) -> None:
    curve = curves.simplification
    assert curve.least is not None
    assert curve.least * len(surface.vertices) >= 10_000
    assert curve.least < 1
    for point in curve.points:
        if point.amount >= curve.least:
            assert point.mean_distance_um <= curves.voxel_um
            assert abs(point.area_share - 1) <= 0.01


def test_no_simplification_is_recommended_where_each_costs_more_than_a_voxel(
    surface: SurfaceMesh,
) -> None:
    assert simplification_curve(surface, 1e-9, ignore).least == 1.0
    assert simplification_curve(SurfaceMesh(*torus()), 100.0, ignore).least == 1.0  # too few


def test_each_point_of_the_smoothing_curve_is_the_surface_after_that_many_passes(
    curves: DistortionCurves, surface: SurfaceMesh
) -> None:
    for point in curves.smoothing.points[1:8:3]:
        passes = SmoothParameters(int(point.amount))
        smoothed = surface.moved(smooth(surface.vertices, surface.faces, passes, ignore))
        share = smoothed.face_areas.sum() / surface.face_areas.sum()
        assert point.area_share == pytest.approx(share, rel=1e-9)
        result = measure_distances(smoothed, surface, ignore, 20_000)
        mean = max(result.a_to_b.mean_um, result.b_to_a.mean_um)
        assert point.mean_distance_um == pytest.approx(mean, rel=0.05)


def test_smoothing_is_recommended_from_where_it_goes_slowly() -> None:
    rng = np.random.default_rng(1)
    vertices, faces = sphere(100.0, 6)
    waves = sum(  # of all lengths, as brains have them
        np.sin(vertices @ rng.normal(size=3) * often + rng.uniform(0, 6)) / often
        for often in np.geomspace(0.03, 3, 60)
    )
    rough = SurfaceMesh(vertices * (1 + 0.002 * np.asarray(waves)[:, np.newaxis]), faces)
    least = smoothing_curve(rough, ignore).least
    assert least is not None
    areas = [
        rough.moved(smooth(rough.vertices, faces, SmoothParameters(n), ignore)).face_areas.sum()
        for n in (0, 100, int(least), int(least) + 100)
    ]
    assert areas[2] - areas[3] == pytest.approx(0.15 * (areas[0] - areas[1]), rel=0.15)


def test_a_surface_without_detail_is_never_smoothed_slowly(curves: DistortionCurves) -> None:
    assert curves.smoothing.least is None  # a thin ring, which shrinks


def lossy(loss: Callable[[Floats], Floats]) -> list[Distortion]:
    passes = np.array(PASSES, dtype=float)
    return [Distortion(n, 1, 1 - lost, 0.0) for n, lost in zip(passes, loss(passes), strict=True)]


@pytest.mark.parametrize("power", [0.2, 0.3, 0.4])
def test_where_area_is_lost_as_a_power_of_the_passes_the_first_slow_pass_is_found(
    power: float,
) -> None:
    least = settled_from(lossy(lambda n: 0.03 * n**power))
    assert least is not None
    cost = [((n + 100) ** power - n**power) / 100**power for n in (least - 1, least)]
    assert cost[0] >= 0.15 > cost[1]


def test_what_is_recommended_hardly_changes_with_the_curve() -> None:
    rng = np.random.default_rng(3)
    least = settled_from(lossy(lambda n: 0.04 * n**0.35))
    for _ in range(50):
        noise = rng.normal(1, 0.01, len(PASSES))
        found = settled_from(lossy(lambda n, noise=noise: 0.04 * n**0.35 * noise))  # type: ignore[misc]
        assert found == pytest.approx(least, rel=0.15)


def test_no_smoothing_is_recommended_where_it_does_not_slow_down_or_costs_nothing() -> None:
    assert settled_from(lossy(lambda n: 0.0005 * n)) is None
    assert settled_from(lossy(np.zeros_like)) is None


def test_curves_can_be_cancelled(surface: SurfaceMesh) -> None:
    def report(fraction: float, text: str) -> None:
        assert 0 <= fraction <= 1
        if fraction > 0.1:
            raise Cancelled

    with pytest.raises(Cancelled):
        find_curves(surface, 1.0, report)


def test_the_picture_has_a_panel_for_each_quantity_of_both_curves(curves: DistortionCurves) -> None:
    root = ElementTree.fromstring(draw_curves(curves))
    lines = root.findall(f".//{SVG}polyline")
    assert len(lines) == 4
    for line, curve in zip(lines, [curves.simplification, curves.smoothing] * 2, strict=True):
        places = np.array([pair.split(",") for pair in line.attrib["points"].split()], float)
        assert len(places) == len(curve.points)
        amounts = [point.amount for point in curve.points]
        assert np.corrcoef(places[:, 0], amounts)[0, 1] == pytest.approx(1, abs=1e-6)
    words = [text.text for text in root.findall(f".//{SVG}text")]
    assert words.count("recommended") == 2  # both of simplification
    assert "share of the vertices kept" in words


def test_a_chart_shows_values_where_its_ticks_say() -> None:
    line = Line("a < b & c", (1e-6, 1e-3, 1.0), (2.0, 4.0, float("nan")))
    panel = Panel(
        "title", (line,), Axis("x", True), Axis("y"), (Mark(1e-3, "here"),), Band(1e-4, 1.0, "good")
    )
    root = ElementTree.fromstring(draw_panels([panel]))
    ticks = {
        text.text: float(text.attrib["x"])
        for text in root.findall(f".//{SVG}text")
        if text.attrib["text-anchor"] == "middle"
    }
    points = root.find(f".//{SVG}polyline").attrib["points"].split()  # type: ignore[union-attr]
    assert len(points) == 2
    assert float(points[0].split(",")[0]) == pytest.approx(ticks["1e-6"], abs=0.1)
    dashed = [rule for rule in root.findall(f".//{SVG}line") if "stroke-dasharray" in rule.attrib]
    assert float(dashed[0].attrib["x1"]) == float(points[1].split(",")[0])
    assert root.find(f".//{SVG}title").text == "a < b & c"  # type: ignore[union-attr]


@pytest.mark.parametrize("values", [(3.0, 3.0), (0.0, 0.0), (-2.0, 5.0), (1e-9, 2e-9), (1e7, 9e7)])
def test_a_chart_of_any_values_has_ticks(values: tuple[float, float]) -> None:
    for axis in (Axis("y"), Axis("y", is_logarithmic=True)):
        panel = Panel("title", (Line("line", (0.0, 1.0), values),), Axis("x"), axis)
        root = ElementTree.fromstring(draw_panels([panel]))
        ends = [
            text for text in root.findall(f".//{SVG}text") if text.attrib["text-anchor"] == "end"
        ]
        assert 1 <= len(ends) <= 8


def test_the_command_tells_and_draws_both_curves(
    demo_files: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "new" / "curves.svg"
    command = ["curves", str(demo_files[0]), *COARSE, "--json"]
    assert main([*command, "-o", str(picture)]) == DONE
    facts = json.loads(capsys.readouterr().out)
    assert facts["smoothing"]["points"][0]["mean_distance_um"] == 0
    assert {"amount", "vertices", "area_share"} <= facts["simplification"]["points"][0].keys()
    assert "area within 1%" in facts["simplification"]["reason"]
    assert ElementTree.parse(picture).getroot().tag == f"{SVG}svg"
    assert main([*command, "-o", str(tmp_path)]) == BAD_INPUT
    assert "it is a folder" in capsys.readouterr().err
