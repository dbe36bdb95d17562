"""Comparing methods beside the window: what is asked, and what comes of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from flyreg_core.apart import Limits
from flyreg_core.comparison import Comparison, Row, compare
from flyreg_core.comparison_pictures import draw_methods
from flyreg_core.comparison_report import comparison_report, write_comparison
from flyreg_core.errors import Cancelled
from flyreg_core.facts import Facts
from flyreg_core.picture import Picture
from flyreg_core.point_files import read_point_pairs_um
from flyreg_core.progress import Report, within
from flyreg_core.project import Project, Unit


@dataclass(frozen=True)
class Question:
    """Which methods are to be compared, on which brains, and by which points."""

    project: Project
    methods: tuple[str, ...]
    points: Path | None
    unit: Unit | None  # of the points; None: that of the files of the brains
    limits: Limits


@dataclass(frozen=True, eq=False)
class Answer:
    """What came of it, as the command would write it."""

    question: Question
    comparison: Comparison
    facts: Facts
    pictures: Mapping[str, Picture]


def answer(question: Question, tell: Callable[[Row], None], report: Report) -> Answer:
    """Compare as asked; see `comparison.compare`. What was cancelled may still come to something."""
    project = question.project
    truth = None
    if question.points is not None:
        truth = read_point_pairs_um(question.points, project, question.unit)
    part = within(report, 0.0, 0.97)
    found = compare(project, question.methods, truth, question.limits, part, tell)
    with suppress(Cancelled):  # what is ready is worth being drawn
        report(0.97, "drawing the surfaces")
    facts = comparison_report(found, project.source.input, project.target.input, question.limits)
    return Answer(question, found, facts, draw_methods(found))


def write_answer(folder: Path, answer: Answer, report: Report) -> Path:
    """Write what `flyreg compare` writes, and return where the page is."""
    report(0.0, "writing")
    unit = answer.question.project.target.input.unit
    write_comparison(folder, answer.comparison, answer.facts, unit, answer.pictures)
    return folder / "compare.html"
