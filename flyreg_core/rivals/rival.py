"""What every rival is and returns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

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

    name: str
    description: str  # with the settings that are not its authors' defaults
    run: Callable[[SurfaceMesh, SurfaceMesh, Report], Moved]
    is_aligned: bool = True  # whether it starts from the engine's affine alignment


def moved_by(carry: SpaceMap, source: SurfaceMesh) -> Moved:
    """Return a source moved by a map of space."""
    return Moved(carry(source.vertices), carry)
