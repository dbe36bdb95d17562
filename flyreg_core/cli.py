"""The `flyreg` command: one thin function per subcommand, everything else in the engine."""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
import time
import traceback
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flyreg_core.arguments import AUTOMATIC, make_parser
from flyreg_core.brain_options import brain_of, prepared_as_told
from flyreg_core.errors import FlyregError

if TYPE_CHECKING:
    from flyreg_core.point_files import PointPairs
    from flyreg_core.progress import Report
    from flyreg_core.project import Project
    from flyreg_core.results import Results

DONE, WRONG_USAGE, BAD_INPUT, INTERNAL_ERROR, INTERRUPTED = 0, 2, 3, 4, 130
BAR = 30


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status."""
    arguments = make_parser(_COMMANDS).parse_args(argv)
    try:
        arguments.run(arguments)
    except FlyregError as error:
        _say(f"flyreg: {error}")
        return BAD_INPUT
    except BrokenPipeError:
        return DONE
    except KeyboardInterrupt:
        _say("flyreg: interrupted; nothing was written")
        return INTERRUPTED
    except Exception:
        _say(f"flyreg: an internal error; please report it with the file {_log_error()}")
        return INTERNAL_ERROR
    return DONE


def _inspect(arguments: argparse.Namespace) -> None:
    from flyreg_core.pipeline import Pipeline
    from flyreg_core.preparation_report import inspect_report

    brain = brain_of(arguments.brain, arguments)
    with _Progress() as progress:
        raw, torus = Pipeline().make_torus(brain, progress)
    _print(inspect_report(brain.input, raw, torus), arguments.json)


def _prepare(arguments: argparse.Namespace) -> None:
    from flyreg_core.brain_files import check_mesh_place, write_mesh
    from flyreg_core.files import make_folder
    from flyreg_core.pipeline import Pipeline
    from flyreg_core.preparation_report import prepare_report
    from flyreg_core.progress import within
    from flyreg_core.simplify import simplify

    started = time.perf_counter()
    check_mesh_place(arguments.output)
    brain = brain_of(arguments.brain, arguments)
    with _Progress() as progress:
        raw, torus = Pipeline().make_torus(brain, within(progress, 0.0, 0.8))
        simplified = simplify(torus.surface, brain.simplify, within(progress, 0.8, 0.9))
        facts = prepare_report(raw, torus, simplified, within(progress, 0.9, 1.0))
    make_folder(arguments.output.resolve().parent)
    write_mesh(arguments.output, simplified.surface, brain.input.unit)
    for warning in (*torus.warnings, *simplified.warnings):
        _say(f"flyreg: {warning}")
    _print({**facts, **_cost(started)}, arguments.json)


def _curves(arguments: argparse.Namespace) -> None:
    from flyreg_core.brain_files import voxel_edge_um
    from flyreg_core.distortion_curves import curves_report, draw_curves, find_curves
    from flyreg_core.files import check_place, make_folder, write_atomically
    from flyreg_core.pipeline import Pipeline
    from flyreg_core.progress import within

    if arguments.output is not None:
        check_place(arguments.output)
    brain = brain_of(arguments.brain, arguments)
    with _Progress() as progress:
        _, torus = Pipeline().make_torus(brain, within(progress, 0.0, 0.4))
        edge = voxel_edge_um(brain.input)
        curves = find_curves(torus.surface, edge, within(progress, 0.4, 1.0))
    if arguments.output is not None:
        make_folder(arguments.output.resolve().parent)
        write_atomically(arguments.output, draw_curves(curves, paper="#ffffff"))
    _print(curves_report(curves), arguments.json)


def _register(arguments: argparse.Namespace) -> None:
    from flyreg_core.cache import open_cache
    from flyreg_core.files import check_place
    from flyreg_core.pipeline import Pipeline
    from flyreg_core.point_files import read_point_pairs_um

    started = time.perf_counter()
    check_place(arguments.output / "registered.ply")
    project, truth = _project(arguments), None
    if arguments.points is not None:
        truth = read_point_pairs_um(arguments.points, project, arguments.unit)
    pipeline, advice = Pipeline(open_cache()), None
    with _Progress() as progress:
        results = pipeline.run(project, progress)
        if arguments.smoothing == AUTOMATIC and results.judgement is not None:
            advice = results.judgement.cross_validation.advise(project.smoothing)
            if advice.smoothing is not None:
                project = replace(project, smoothing=advice.smoothing)
                results = pipeline.run(project, progress)
    facts = _write_results(results, truth, arguments.output, started)
    if advice is not None and advice.smoothing is None:
        _say(f"flyreg: {advice.reason} lambda stays {project.smoothing:g}.")
    for warning in results.warnings:
        _say(f"flyreg: {warning}")
    _print(facts, arguments.json)


def _write_results(
    results: Results, truth: PointPairs | None, folder: Path, started: float
) -> dict[str, object]:
    from flyreg_core.cost import with_cost
    from flyreg_core.files import make_folder
    from flyreg_core.project_file import save_project
    from flyreg_core.registration_error import register_report_on
    from flyreg_core.report import write_flat, write_registered
    from flyreg_core.report_page import write_report
    from flyreg_core.side_by_side import both
    from flyreg_core.vertex_pairs import write_vertex_pairs

    def write_meshes() -> None:
        write_registered(folder / "registered.ply", results)
        write_flat(folder / "flat.npz", results)
        write_vertex_pairs(folder / "vertex-pairs.csv", results)

    make_folder(folder)
    save_project(results.project, folder / "project.flyreg")
    spent = time.perf_counter() - started
    facts = with_cost(register_report_on(truth, results), spent, results.seconds)
    both(
        write_meshes,
        lambda: write_report(folder / "report.html", "project.flyreg", results, facts),
    )
    return facts


def _project(arguments: argparse.Namespace) -> Project:
    """Return the project that the arguments of `register` ask for."""
    from flyreg_core.flatten import FlattenParameters
    from flyreg_core.project import Project
    from flyreg_core.project_file import load_project
    from flyreg_core.smooth import SmoothParameters

    names = [name for name in (arguments.source, arguments.target) if name is not None]
    if len(names) == 1 or not (names or arguments.project):
        raise FlyregError("give both a source and a target brain, or a project with --project")
    if not arguments.project:
        source, target = (
            brain_of(name, arguments, role)
            for name, role in zip(names, ("source", "target"), strict=True)
        )
        project = Project(source, target)
    else:
        project = load_project(arguments.project)
        source = prepared_as_told(project.source, arguments, "source")
        target = prepared_as_told(project.target, arguments, "target")
        if names:
            source = replace(source, input=brain_of(names[0], arguments, "source").input)
            target = replace(target, input=brain_of(names[1], arguments, "target").input)
        project = replace(project, source=source, target=target)
    if arguments.smoothing_passes is not None:
        project = _with_both(project, smooth=SmoothParameters(arguments.smoothing_passes))
    if arguments.flattening_passes is not None:
        project = _with_both(project, flatten=FlattenParameters(arguments.flattening_passes))
    if arguments.pairing is not None:
        project = replace(project, boundary=replace(project.boundary, pairing=arguments.pairing))
    if arguments.method == "paper":
        from flyreg_core.edits import as_in_the_paper

        project = as_in_the_paper(project)
    if arguments.smoothing not in (None, AUTOMATIC):
        project = replace(project, smoothing=arguments.smoothing)
    if arguments.landmarks is not None:
        project = _with_landmarks(project, arguments.landmarks)
    return project


def _with_both(project: Project, **changes: object) -> Project:
    return replace(
        project,
        source=replace(project.source, **changes),  # type: ignore[arg-type]
        target=replace(project.target, **changes),  # type: ignore[arg-type]
    )


def _with_landmarks(project: Project, path: Path) -> Project:
    from flyreg_core.brain_files import UM_PER_UNIT
    from flyreg_core.edits import add_pair
    from flyreg_core.landmark_files import read_landmark_pairs, to_landmark_pairs

    pairs = to_landmark_pairs(
        read_landmark_pairs(path),
        UM_PER_UNIT[project.source.input.unit],
        UM_PER_UNIT[project.target.input.unit],
    )
    if not any(pair.is_placed for pair in pairs):
        raise FlyregError(f"{path} has {len(pairs)} landmarks but none with a place on both brains")
    for pair in pairs:
        project = add_pair(project, pair)
    return project


def _transform(arguments: argparse.Namespace) -> None:
    from flyreg_core.brain_files import UM_PER_UNIT
    from flyreg_core.cache import open_cache
    from flyreg_core.files import check_place
    from flyreg_core.pipeline import Pipeline
    from flyreg_core.point_files import read_points, write_points
    from flyreg_core.project_file import load_project
    from flyreg_core.transform import REACH_UM, carry, check_reach

    check_place(arguments.output)
    project = load_project(arguments.project)
    table = read_points(arguments.points)
    reach = REACH_UM if arguments.reach is None else arguments.reach
    check_reach(reach)
    with _Progress() as progress:
        results = Pipeline(open_cache()).run(project, progress, measure=False)
    units = [brain.input.unit for brain in (project.source, project.target)]
    if arguments.inverse:
        units.reverse()
    points = table.points * UM_PER_UNIT[arguments.unit or units[0]]
    moved = carry(points, results, reach, arguments.inverse)
    write_points(arguments.output, table, moved, UM_PER_UNIT[arguments.unit or units[1]])
    mapped = int(moved.is_mapped.sum())
    facts = {"points": len(points), "mapped": mapped, "outside": len(points) - mapped}
    _print(facts, arguments.json)


def _distance(arguments: argparse.Namespace) -> None:
    from flyreg_core.brain_files import open_brain, read_brain, voxel_edge_um
    from flyreg_core.report import distance_report
    from flyreg_core.surface_distance import measure_distances
    from flyreg_core.volume_formats import is_volume

    size, edge = arguments.voxel_size, _cube_edge(arguments.voxel_size)
    inputs = [
        open_brain(name, arguments.unit, size if is_volume(Path(name)) else None)
        for name in (arguments.a, arguments.b)
    ]
    if edge is None:
        edge = voxel_edge_um(inputs[1]) or voxel_edge_um(inputs[0])
    a, b = (read_brain(brain) for brain in inputs)
    with _Progress() as progress:
        distances = measure_distances(a, b, progress)
    _print(distance_report(distances, "a_to_b", "b_to_a", edge), arguments.json)


def _compare(arguments: argparse.Namespace) -> None:
    from flyreg_core.apart import Limits
    from flyreg_core.comparison import METHODS, compare
    from flyreg_core.comparison_report import as_table, comparison_report, write_comparison
    from flyreg_core.files import check_place
    from flyreg_core.point_files import read_point_pairs_um
    from flyreg_core.project import Project

    if arguments.output is not None:
        check_place(arguments.output / "compare.json")
    limits = Limits(arguments.time_limit, arguments.memory_limit)
    source = brain_of(arguments.source, arguments, "source")
    target = brain_of(arguments.target, arguments, "target")
    project, truth = Project(source, target), None
    if arguments.points is not None:
        truth = read_point_pairs_um(arguments.points, project, arguments.unit)
    with _Progress() as progress:
        found = compare(project, arguments.methods or METHODS, truth, limits, progress)
    facts = comparison_report(found, source.input, target.input, limits)
    if arguments.output is not None:
        write_comparison(arguments.output, found, facts, target.input.unit)
    if arguments.json:
        _print(facts, as_json=True)
    else:
        print(as_table(facts))


def _cube_edge(size: Sequence[float] | None) -> float | None:
    """Return the edge of a cube as large as a voxel."""
    if size is None:
        return None
    if not all(math.isfinite(edge) and edge > 0 for edge in size):
        edges = " x ".join(f"{edge:g}" for edge in size)
        raise FlyregError(f"a voxel has three positive edges in micrometres, not {edges}")
    return math.prod(size) ** (1 / 3)


class _Progress:
    """A bar on stderr when that is a terminal; a report for the engine."""

    def __init__(self) -> None:
        self._shown = sys.stderr.isatty()
        self._last = -1
        self._text = ""

    def __enter__(self) -> Report:
        return self._report

    def __exit__(self, *_: object) -> None:
        if self._shown:
            sys.stderr.write("\r" + " " * 78 + "\r")
            sys.stderr.flush()

    def _report(self, fraction: float, text: str) -> None:
        percent = int(100 * min(max(fraction, 0.0), 1.0))
        if self._shown and (percent, text) != (self._last, self._text):
            self._last, self._text = percent, text
            bar = "#" * (BAR * percent // 100)
            sys.stderr.write(f"\r[{bar:<{BAR}}] {percent:3d} % {text:<38.38}")
            sys.stderr.flush()


def _print(facts: object, as_json: bool) -> None:
    if as_json:
        print(json.dumps(facts))
    else:
        print("\n".join(_lines(facts)))


def _lines(facts: Any, indent: str = "") -> list[str]:
    """Return facts as indented lines for people."""
    lines = []
    for key, value in facts.items() if isinstance(facts, dict) else enumerate(facts, 1):
        if isinstance(value, (dict, list, tuple)) and value and not _is_flat(value):
            lines += [f"{indent}{key}:", *_lines(value, indent + "  ")]
        else:
            lines.append(f"{indent}{key}: {_shown(value)}")
    return lines


def _is_flat(value: object) -> bool:
    return isinstance(value, (list, tuple)) and all(isinstance(v, (int, float)) for v in value)


def _shown(value: object) -> str:
    if isinstance(value, (list, tuple)):
        return ", ".join(_shown(part) for part in value) if value else "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    return "unknown" if value is None else str(value)


def _cost(started: float) -> dict[str, object]:
    from flyreg_core.cost import peak_memory_mb

    return {
        "seconds": round(time.perf_counter() - started, 2),
        "peak_memory_mb": peak_memory_mb(),
    }


def _say(text: str) -> None:
    print(text, file=sys.stderr)


def _log_error() -> str:
    with tempfile.NamedTemporaryFile(
        "w", prefix="flyreg-error-", suffix=".log", delete=False, encoding="utf-8"
    ) as log:
        traceback.print_exc(file=log)
    return log.name


_COMMANDS = {
    "inspect": _inspect,
    "prepare": _prepare,
    "curves": _curves,
    "register": _register,
    "transform": _transform,
    "distance": _distance,
    "compare": _compare,
}


if __name__ == "__main__":
    sys.exit(main())
