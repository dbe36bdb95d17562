"""The whole method: what is computed again after which edit, and that memory changes nothing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core import edits
from flyreg_core.brain_files import open_brain
from flyreg_core.cache import Cache
from flyreg_core.cut_height import CutParameters
from flyreg_core.errors import Cancelled, FlyregError, LandmarkError
from flyreg_core.handles import HandleParameters
from flyreg_core.landmarks import CORNERS, LandmarkPair
from flyreg_core.matching import who_decides
from flyreg_core.memo import Memo
from flyreg_core.pipeline import Pipeline
from flyreg_core.progress import ignore
from flyreg_core.project import Project
from flyreg_core.results import Results, find_warnings
from flyreg_core.smooth import SmoothParameters
from flyreg_core.transform import transform_points
from flyreg_core.trim import TrimParameters

SEVERAL_MICROMETRES = 2.0
THERE_AND_BACK_UM = 0.5
AS_SEEN = 1e-6
"""How far vertices may be off while a hand moves, as a share of the diagonal."""
LANDMARKS = {"boundary landmarks", "suggestions", "landmarks", "live splines"}
AFTER_SPLINE = {"spline", "lift", "distances", "judgement"}


@pytest.fixture(scope="module")
def pipeline() -> Pipeline:
    return Pipeline()


@pytest.fixture(scope="module")
def results(pipeline: Pipeline, demo_project: Project) -> Results:
    return pipeline.run(demo_project)


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Cache:
    """Where new pipelines find the brains that another new one has prepared."""
    return Cache(tmp_path_factory.mktemp("cache"))


def stages_run(pipeline: Pipeline, project: Project) -> set[str]:
    """Return the stages that a run computed."""
    seconds = pipeline.run(project).seconds
    return {name for name, duration in seconds.items() if duration > 0}


def interior_pair(results: Results, shift: float = 0.0) -> LandmarkPair:
    """Return a pair between corresponding places in the middle of a half, the target end moved."""
    half = results.source.halves["anterior"]
    middle = np.abs(half.plane - [0.0, 0.65]).sum(axis=1).argmin()
    vertex = half.vertex_of[middle]
    source = results.source.surface.vertices[vertex]
    target = results.registration.surface.vertices[vertex] + [shift, 0, 0]
    return LandmarkPair("user-a", "a", "interior", None, tuple(source), tuple(target))


def test_the_bar_does_not_begin_anew_when_the_brains_are_prepared(pipeline, results, demo_project):
    told = []
    changed = replace(demo_project, boundary=replace(demo_project.boundary, per_seam=5))
    pipeline.run(changed, lambda fraction, text: told.append((fraction, text)))
    assert {"placing landmarks", "bending the source"} <= {text for _, text in told}
    assert min(told)[0] >= 0.84


@pytest.mark.parametrize(
    ("edit", "expected"),
    [
        (lambda p: p, set()),
        (lambda p: edits.set_smoothing(p, 0.3), AFTER_SPLINE),
        (lambda p: edits.set_weight(p, "upper-04", 5.0), {"landmarks"} | AFTER_SPLINE),
        (lambda p: edits.set_weight(p, "upper-04", 0.0), {"landmarks"} | AFTER_SPLINE),
        (
            lambda p: edits.place_pair(p, "upper-04", "target", 0.31),
            {"landmarks"} | AFTER_SPLINE,
        ),
        (
            lambda p: edits.set_brain(p, "source", replace(p.source, cut=CutParameters(3.0))),
            {"cut", "flatten", "prepared", "matching", "laying over", "matching detail", "locators"}
            | LANDMARKS
            | AFTER_SPLINE,
        ),
        (
            lambda p: edits.set_brain(
                p, "source", replace(p.source, handles=HandleParameters(hole=(0.0, 35.0, 10.0)))
            ),
            {"torus", "simplify", "smooth", "cut", "flatten", "prepared", "alignment"}
            | {"shape map", "matching", "laying over", "matching detail", "locators"}
            | LANDMARKS
            | AFTER_SPLINE,
        ),
        (
            lambda p: edits.set_brain(p, "target", replace(p.target, smooth=SmoothParameters(50))),
            {"smooth", "cut", "flatten", "prepared", "laying over", "matching detail", "locators"}
            | LANDMARKS
            | AFTER_SPLINE,
        ),
    ],
)
def test_an_edit_reruns_only_what_follows_from_it(
    pipeline: Pipeline,
    demo_project: Project,
    edit: Callable[[Project], Project],
    expected: set[str],
) -> None:
    pipeline.run(demo_project)
    assert stages_run(pipeline, edit(demo_project)) == expected


def test_going_back_to_an_earlier_preparation_computes_nothing_slow(
    pipeline: Pipeline, results: Results, demo_project: Project
) -> None:
    other = edits.set_brain(
        demo_project, "source", replace(demo_project.source, cut=CutParameters(4.0))
    )
    pipeline.run(other)
    slow = {"read", "solid", "torus", "simplify", "smooth", "cut", "flatten"}
    assert not stages_run(pipeline, demo_project) & slow


@settings(max_examples=2)
@given(
    steps=st.lists(
        st.tuples(
            st.sampled_from(["upper-04", "lower-02", "hole-03", "anterior-left-01"]),
            st.sampled_from([0.0, 0.1, 1.0, 30.0]),
            st.sampled_from([0.0, 1e-3, 1e-1]),
        ),
        min_size=1,
        max_size=4,
    )
)
def test_what_the_hand_sees_is_what_a_new_solution_gives_and_at_rest_it_is_that(
    pipeline: Pipeline,
    cache: Cache,
    demo_project: Project,
    steps: list[tuple[str, float, float]],
) -> None:
    project = demo_project
    for identifier, weight, smoothing in steps:
        project = edits.set_smoothing(edits.set_weight(project, identifier, weight), smoothing)
        pipeline.run(project, measure=False)
    fresh = Pipeline(cache).run(project).registration.surface
    moving = pipeline.run(project, measure=False).registration.surface.vertices
    assert np.abs(moving - fresh.vertices).max() < AS_SEEN * fresh.diagonal
    at_rest = pipeline.run(project).registration.surface.vertices
    assert np.array_equal(at_rest, fresh.vertices)


def test_undoing_weights_and_lambda_restores_each_vertex(
    pipeline: Pipeline, results: Results, demo_project: Project
) -> None:
    changed = edits.set_smoothing(edits.set_weight(demo_project, "upper-04", 30.0), 1.0)
    moved = pipeline.run(changed).registration.surface.vertices
    assert not np.array_equal(moved, results.registration.surface.vertices)
    back = pipeline.run(demo_project).registration.surface.vertices
    assert np.array_equal(back, results.registration.surface.vertices)


def test_a_cancelled_run_leaves_what_was_remembered(
    pipeline: Pipeline, demo_project: Project
) -> None:
    pipeline.run(demo_project)

    def stop(fraction: float, text: str) -> None:
        raise Cancelled

    finer = replace(demo_project.source, cut=CutParameters(5.0))
    with pytest.raises(Cancelled):
        pipeline.run(edits.set_brain(demo_project, "source", finer), stop)
    assert stages_run(pipeline, demo_project) == set()


def test_a_stage_that_fails_keeps_its_last_result() -> None:
    def divide(a: int, b: int, report: object) -> float:
        return a / b

    memo = Memo("divide", divide)
    assert memo(6, 3, report=ignore) == 2
    with pytest.raises(ZeroDivisionError):
        memo(6, 0, report=ignore)
    seconds = memo.seconds
    assert memo(6, 3, report=ignore) == 2
    assert memo.seconds == seconds


def test_a_brain_registered_to_itself_stays_where_it_is(
    pipeline: Pipeline, demo_project: Project
) -> None:
    project = replace(demo_project, target=demo_project.source)
    results = pipeline.run(project)
    surface = results.source.surface
    moved = np.abs(results.registration.surface.vertices - surface.vertices).max()
    assert moved <= 1e-9 * surface.diagonal
    assert results.distances is not None
    assert results.distances.a_to_b.hausdorff_um <= 1e-6


def test_a_landmark_of_the_user_pulls_its_place_towards_its_target(
    pipeline: Pipeline, results: Results, demo_project: Project
) -> None:
    pair = interior_pair(results, shift=15.0)
    before = pipeline.run(edits.add_pair(demo_project, replace(pair, weight=0.0)))
    after = pipeline.run(edits.add_pair(demo_project, replace(pair, weight=100.0)))
    residual = [r.registration.residual_um["user-a"] for r in (before, after)]
    assert residual[1] < residual[0] - SEVERAL_MICROMETRES


def test_a_heavier_landmark_leaves_a_smaller_residual(
    pipeline: Pipeline, results: Results, demo_project: Project
) -> None:
    pair = interior_pair(results, shift=15.0)
    residuals = [
        pipeline.run(
            edits.add_pair(demo_project, replace(pair, weight=weight)), measure=False
        ).registration.residual_um["user-a"]
        for weight in (0.01, 0.1, 1.0, 10.0)
    ]
    assert residuals == sorted(residuals, reverse=True)


def test_muting_a_landmark_is_as_if_it_had_no_weight(
    pipeline: Pipeline, results: Results, demo_project: Project
) -> None:
    added = edits.add_pair(demo_project, interior_pair(results, shift=15.0))
    muted = pipeline.run(edits.set_muted(added, ["user-a"], True))
    assert np.array_equal(
        muted.registration.surface.vertices, results.registration.surface.vertices
    )
    assert "user-a" not in muted.judgement.leave_one_out_um


def test_a_landmark_that_plays_solo_pulls_with_the_corners_alone(
    pipeline: Pipeline, results: Results, demo_project: Project
) -> None:
    added = edits.add_pair(demo_project, interior_pair(results, shift=15.0))
    solo = pipeline.run(edits.set_solo(added, ["user-a"]), measure=False)
    pulling = {mark.pair.id for mark in solo.landmarks if mark.weight > 0}
    assert pulling == {"user-a", *CORNERS}


def test_a_half_made_landmark_is_named_and_not_used(
    pipeline: Pipeline, results: Results, demo_project: Project
) -> None:
    pair = replace(interior_pair(results), target=None, name="calyx")
    half_made = pipeline.run(edits.add_pair(demo_project, pair))
    assert "“calyx” is not placed on both brains and is not used" in half_made.warnings
    assert np.array_equal(
        half_made.registration.surface.vertices, results.registration.surface.vertices
    )


def test_a_landmark_on_different_halves_is_named_and_not_used(
    pipeline: Pipeline, results: Results, demo_project: Project
) -> None:
    behind = results.target.halves["posterior"]
    vertex = behind.vertex_of[np.abs(behind.plane - [0.0, 0.65]).sum(axis=1).argmin()]
    target = tuple(results.target.surface.vertices[vertex])
    pair = replace(interior_pair(results), target=target, name="calyx")
    crossed = pipeline.run(edits.add_pair(demo_project, pair))
    assert any("calyx lies on different halves" in warning for warning in crossed.warnings)
    assert np.array_equal(
        crossed.registration.surface.vertices, results.registration.surface.vertices
    )


def test_landmarks_left_on_one_line_are_refused_in_a_sentence(
    pipeline: Pipeline, results: Results, demo_project: Project
) -> None:
    others = [mark.pair.id for mark in results.landmarks if mark.pair.kind != "upper"]
    with pytest.raises(LandmarkError, match="lie on one line"):
        pipeline.run(edits.set_weights(demo_project, others, 0.0))


@pytest.mark.parametrize("pairing", ["coordinate", "arc length", "nearest"])
def test_each_way_of_pairing_gives_a_closed_surface_without_folds(
    pipeline: Pipeline, demo_project: Project, pairing: str
) -> None:
    boundary = replace(demo_project.boundary, pairing=pairing)  # type: ignore[arg-type]
    results = pipeline.run(replace(demo_project, boundary=boundary))
    assert [half.flipped for half in results.registration.halves.values()] == [0, 0]
    assert results.registration.flipped_on_caps == 0


def test_both_directions_are_one_map(
    pipeline: Pipeline, results: Results, demo_project: Project
) -> None:
    turned = replace(demo_project, source=demo_project.target, target=demo_project.source)
    back = pipeline.run(turned)
    there = results.registration.surface.vertices
    again = transform_points(there, back.source.surface, back.registration.surface)
    away = np.linalg.norm(again.points - results.source.surface.vertices, axis=1)
    assert away.mean() < THERE_AND_BACK_UM
    assert results.judgement is not None
    told = results.judgement.there_and_back_um
    assert told.mean() == pytest.approx(float(away.mean()), rel=0.2)


def test_the_brain_that_the_user_trimmed_decides_for_both(demo_project: Project) -> None:
    source, target = demo_project.source, demo_project.target
    trimmed = replace(target, trim=TrimParameters(right=-200.0))
    assert who_decides(source, target) is None
    assert who_decides(source, trimmed) == "target"
    assert who_decides(trimmed, source) == "source"
    assert who_decides(trimmed, trimmed) is None


def test_a_changed_file_is_noticed(tmp_path: Path, demo_project: Project) -> None:
    copy = tmp_path / "brain.ply"
    copy.write_bytes(Path(demo_project.source.input.path).read_bytes())
    brain = replace(demo_project.source, input=open_brain(str(copy)))
    content = copy.read_bytes()
    copy.write_bytes(content[:-20] + content[-20:][::-1])
    with pytest.raises(FlyregError, match="changed"):
        Pipeline().prepare(brain)


@pytest.mark.parametrize("is_guess", [False, True])
def test_a_guessed_oesophagus_is_told_with_its_brain(results: Results, is_guess: bool) -> None:
    torus = replace(results.source.torus, is_guess=is_guess)
    source = replace(results.source, torus=torus)
    warnings = find_warnings(
        *(source, results.target, results.alignment, ()), results.landmarks, results.registration
    )
    name = results.source.brain.input.name
    told = [text for text in warnings if text.startswith(f"{name}: the oesophagus is a guess")]
    assert len(told) == is_guess
    assert all("um wide" in text and torus.chosen_by in text for text in told)
