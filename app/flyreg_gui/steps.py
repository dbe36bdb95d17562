"""How far the method has come: the state and the main numbers of each step, without any widget."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum

from flyreg_core.errors import InputError, LandmarkError
from flyreg_core.project import BrainInput, Project
from flyreg_core.results import PreparedBrain, Results
from flyreg_gui.failures import as_sentence
from flyreg_gui.session import Failure, Session


class Step(IntEnum):
    """The steps, in their order."""

    BRAINS = 0
    PREPARE = 1
    FLATTEN = 2
    REGISTER = 3
    JUDGE = 4
    TAKE_AWAY = 5


TITLES = ("Brains", "Prepare", "Flatten", "Register", "Judge", "Take away")


class State(Enum):
    """What is known of a step; the value is what the user reads."""

    WAITING = "waiting"
    RUNNING = "running"
    DONE = "done"
    READY = "ready"
    STALE = "out of date"
    FAILED = "failed"


@dataclass(frozen=True)
class StepReport:
    """One step as the user sees it."""

    step: Step
    state: State
    details: tuple[str, ...]


WORDS_OF_WORK = (
    (Step.BRAINS, ("reading",)),
    (Step.FLATTEN, ("flatten", "flat")),
    (Step.JUDGE, ("measur", "distance", "judg")),
    (Step.REGISTER, ("spline", "landmark", "lift", "mov", "pair", "warp", "regist", "fold")),
)
"""How reports of the pipeline tell which step they belong to; any other is about preparing."""


def step_of_work(text: str) -> Step:
    """Return the step that a report of the pipeline belongs to."""
    for step, words in WORDS_OF_WORK:
        if any(word in text.lower() for word in words):
            return step
    return Step.PREPARE


def report_steps(session: Session) -> list[StepReport]:
    """Return the state of all steps."""
    states = [_state(session, step) for step in Step]
    details = _details(session)
    return [StepReport(step, states[step], tuple(details[step])) for step in Step]


def _state(session: Session, step: Step) -> State:
    if session.project is None:
        return State.WAITING
    first = _first_affected(session.project, session.results)
    if step is Step.TAKE_AWAY and session.is_up_to_date:
        return State.READY  # measuring it changes nothing about what is taken away
    if session.is_complete or step < first:
        return State.DONE
    later = State.WAITING if session.results is None else State.STALE
    if session.failure is not None:
        at = max(_step_of_failure(session.failure), first)
        if step == at:
            return State.FAILED
    elif session.is_running:
        at = max(step_of_work(session.work), first)
        if step == at:
            return State.RUNNING
    else:
        return later
    return State.DONE if step < at else later


def _first_affected(project: Project, results: Results | None) -> Step:
    """Return the first step whose results are not those of the project."""
    if results is None:
        return Step.BRAINS
    shown = results.project
    pairs = ((shown.source, project.source), (shown.target, project.target))
    if any(old.input != new.input for old, new in pairs):
        return Step.BRAINS
    if any(old != new for old, new in pairs):
        return Step.PREPARE
    return Step.JUDGE if shown == project else Step.REGISTER


def _step_of_failure(failure: Failure) -> Step:
    if isinstance(failure.error, InputError):
        return Step.BRAINS
    if isinstance(failure.error, LandmarkError):
        return Step.REGISTER
    return step_of_work(failure.work)


def _details(session: Session) -> dict[Step, list[str]]:
    project, results = session.project, session.results
    details: dict[Step, list[str]] = {step: [] for step in Step}
    if project is not None:
        details[Step.BRAINS] = [
            _describe_input("Source", project.source.input),
            _describe_input("Target", project.target.input),
        ]
    if results is not None:
        details[Step.PREPARE] = [
            _describe_brain("Source", results.source),
            _describe_brain("Target", results.target),
        ]
        about_brains = {
            f"{brain.brain.input.name}: {text}"
            for brain in (results.source, results.target)
            for text in brain.torus.warnings
        }
        others = [text for text in results.warnings if text not in about_brains]
        details[Step.FLATTEN] = [_describe_halves(results)]
        details[Step.REGISTER] = [_describe_registration(results), *map(as_sentence, others)]
        details[Step.JUDGE] = _describe_distances(results)
        details[Step.TAKE_AWAY] = ["Registered mesh, project, picture"]
    return details


def short_name(brain: BrainInput) -> str:
    """Return a brain's name without the folders of its file."""
    return brain.name.replace("\\", "/").rsplit("/", 1)[-1]


def _describe_input(role: str, brain: BrainInput) -> str:
    return f"{role}: {short_name(brain)}, {brain.unit.replace('um', 'µm')} ({brain.unit_known_by})"


def _describe_brain(role: str, brain: PreparedBrain) -> str:
    handle = brain.torus.oesophagus
    guess = ", a guess" if brain.torus.is_guess else ""
    closed = len(brain.torus.handles) - 1
    also = f", {closed} other{'s' if closed > 1 else ''} closed" if closed else ""
    count = len(brain.surface.vertices)
    return f"{role}: {count:,} vertices; oesophagus {handle.width_um:.0f} µm wide{guess}{also}"


def _describe_halves(results: Results) -> str:
    parts = [f"{name} {len(half.faces):,}" for name, half in results.source.halves.items()]
    return f"Source triangles: {', '.join(parts)}"


def _describe_registration(results: Results) -> str:
    flipped = count_folds(results)
    folds = "no folds" if flipped == 0 else f"{flipped} folded triangles"
    return f"{results.acting} of {len(results.landmarks)} landmarks in use; {folds}"


def count_folds(results: Results) -> int:
    """Return how many triangles lie upside down after the registration."""
    halves = results.registration.halves.values()
    return sum(half.flipped for half in halves) + results.registration.flipped_on_caps


def _describe_distances(results: Results) -> list[str]:
    distances = results.distances
    if distances is None:
        return ["Measured when the sliders are at rest"]
    forth, back = distances.a_to_b, distances.b_to_a
    lines = [
        f"To target: mean {forth.mean_um:.3f}, largest {forth.hausdorff_um:.1f} µm",
        f"From target: mean {back.mean_um:.3f}, largest {back.hausdorff_um:.1f} µm",
    ]
    judgement = results.judgement
    if judgement is not None and len(judgement.there_and_back_um):
        lines.append(f"There and back: {judgement.there_and_back_um.mean():.2f} µm off, mean")
    return lines
