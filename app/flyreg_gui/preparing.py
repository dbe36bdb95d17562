"""The pipeline as the window uses it: a failure tells which brain it is about and what is left."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass, replace

from flyreg_core.edits import Role, brain_of
from flyreg_core.errors import FlyregError, InputError, TopologyError
from flyreg_core.frame import BrainFrame
from flyreg_core.handles import Handle, HandleParameters, as_point
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.pipeline import Pipeline, Results
from flyreg_core.progress import Report, within
from flyreg_core.project import Brain, Project

ROLES: tuple[Role, Role] = ("source", "target")
END_OF_PREPARING = 0.84
"""How much of a run is over when both brains are prepared."""


@dataclass(frozen=True, eq=False)
class RawBrain:
    """What there is of a brain before it is prepared."""

    surface: SurfaceMesh  # as read, micrometres
    frame: BrainFrame
    tunnels: tuple[Handle, ...] = ()  # where the preparation failed for want of an oesophagus


@dataclass(frozen=True, eq=False)
class Remains:
    """What is left when a brain cannot be prepared."""

    role: Role  # the brain that it is about
    brains: Mapping[Role, RawBrain]


class PreparingError(Exception):
    """A brain cannot be prepared; the cause says why."""

    def __init__(self, error: FlyregError, remains: Remains) -> None:
        super().__init__(str(error))
        self.error, self.remains = error, remains


class PreparingPipeline:
    """Prepares one brain after the other, so that it is known which of them fails."""

    def __init__(self, pipeline: Pipeline) -> None:
        self._pipeline = pipeline

    def run(self, project: Project, report: Report, measure: bool) -> Results:
        """Return what follows from a project.

        Raises
        ------
        PreparingError
            One of the brains cannot be prepared.
        FlyregError, Cancelled
            See `Pipeline.run`.
        """
        for number, role in enumerate(ROLES):
            start, end = (END_OF_PREPARING * n / 2 for n in (number, number + 1))
            try:
                self._pipeline.prepare(brain_of(project, role), within(report, start, end))
            except FlyregError as error:
                remains = self._remains(project, role, error, report)
                raise PreparingError(error, remains) from error
        return self._pipeline.run(project, within(report, END_OF_PREPARING, 1.0), measure)

    def _remains(self, project: Project, role: Role, error: FlyregError, report: Report) -> Remains:
        brains = {}
        for each in ROLES:
            with contextlib.suppress(InputError):
                brains[each] = RawBrain(*self._pipeline.raw(brain_of(project, each), report))
        if isinstance(error, TopologyError) and role in brains:
            tunnels = self._tunnels(brain_of(project, role), brains[role], report)
            brains[role] = replace(brains[role], tunnels=tunnels)
        return Remains(role, brains)

    def _tunnels(self, brain: Brain, raw: RawBrain, report: Report) -> tuple[Handle, ...]:
        """Return all tunnels, found by taking any of them for the oesophagus for once."""
        anywhere = HandleParameters(as_point(raw.frame.origin), drills=brain.handles.drills)
        try:
            _, torus = self._pipeline.make_torus(replace(brain, handles=anywhere), report)
        except FlyregError:
            return ()
        return tuple(replace(tunnel, is_oesophagus=False) for tunnel in torus.handles)
