"""What every rival is and returns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec

from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.progress import Report

SpaceMap = Callable[[Floats], Floats]
"""Takes (n, 3) points, micrometres, to where a method puts them."""


@dataclass(frozen=True, eq=False)
class Moved:
    """Where a rival puts a source."""

    vertices: Floats  # (n, 3), of the source, micrometres
    carry: SpaceMap  # of any other points near the source


@dataclass(frozen=True)
class Rival:
    """A method to compare with.

    `run` takes source, target (prepared, micrometres, the source where `is_aligned` says) and a
    report. It raises `ImportError` where its package is missing.
    """

    name: str  # in commands and files
    title: str  # for people
    description: str  # with the settings that are not its authors' defaults
    run: Callable[[SurfaceMesh, SurfaceMesh, Report], Moved]
    is_aligned: bool = True  # whether it starts from the engine's affine alignment
    package: str = ""  # that it needs besides the engine's own

    @property
    def lacking(self) -> str:
        """Why it cannot be run here; empty if it can."""
        is_there = not self.package or find_spec(self.package) is not None
        return "" if is_there else lacks(self.package)


def lacks(package: str | None) -> str:
    """Say that a package is missing, and how to have it."""
    return f"needs the package {package}; install flyreg[rivals] to have it"


def moved_by(carry: SpaceMap, source: SurfaceMesh) -> Moved:
    """Return a source moved by a map of space."""
    return Moved(carry(source.vertices), carry)
