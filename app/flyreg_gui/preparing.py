"""The pipeline as the window uses it: a failure tells which brain it is about and what is left."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass, replace

from PySide6.QtCore import QObject, Signal

from flyreg_core.edits import brain_of
from flyreg_core.errors import FlyregError, InputError, MeshError, TopologyError
from flyreg_core.frame import BrainFrame
from flyreg_core.handles import Handle, HandleParameters, as_point
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.pipeline import Pipeline
from flyreg_core.progress import Report, within
from flyreg_core.project import Brain, Project, Role
from flyreg_core.results import Results

READING = 0.02
"""Share of the work, for its bar."""

ROLES: tuple[Role, Role] = ("source", "target")


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


class PreparingPipeline(QObject):
    """The pipeline, which tells what it read, and after a failure which brain cannot be prepared."""

    brain_read = Signal(object, object, object)  # Project, Role, RawBrain, before preparing begins

    def __init__(self, pipeline: Pipeline, parent: QObject | None = None) -> None:
        super().__init__(parent)
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
        if not self._pipeline.is_prepared(project):
            self._read(project, within(report, 0.0, READING))
        try:
            results = self._pipeline.run(project, report, measure)
        except (InputError, MeshError, TopologyError) as error:
            role = self._role_of_failure(project, report)
            raise PreparingError(error, self._remains(project, role, error, report)) from error
        for brain in (results.source, results.target):
            _ = brain.relief  # found here, beside the window, and known when it is drawn
        return results

    def _read(self, project: Project, report: Report) -> None:
        """Read both brains and tell of it; why one cannot be read is told by the run that follows."""
        for role in ROLES:
            with contextlib.suppress(FlyregError, OSError):
                raw = RawBrain(*self._pipeline.raw(brain_of(project, role), report))
                self.brain_read.emit(project, role, raw)

    def _role_of_failure(self, project: Project, report: Report) -> Role:
        """Return the brain that is to blame: that which cannot be prepared alone either."""
        for role in reversed(ROLES):
            try:
                self._pipeline.prepare(brain_of(project, role), report)
            except FlyregError:
                return role
        return "source"

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
