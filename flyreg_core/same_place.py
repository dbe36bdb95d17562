"""One place of the brain wherever it appears: on source, registered source and target, and laid flat.

Between the surfaces it goes the way of the registration itself, over the strip on which the
target's half lies: the place's triangle there, and back up through the other brain's. So there and
back ends where it began, but for rounding. Trim caps, which no half covers, go by nearest points.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flyreg_core.correspondence import FlatBrain
from flyreg_core.cut import PIECES
from flyreg_core.landmarks import HALVES, HalfName
from flyreg_core.lift import Registration
from flyreg_core.locate import TriangleGrid, build_grid, find_triangles, once_around, strip_grid
from flyreg_core.mesh import Floats, Integers, SurfaceMesh
from flyreg_core.rectangle import from_plane

INSIDE = 1e-9
"""A place so little outside the rectangle, in shares of the way across, still counts as inside."""


@dataclass(frozen=True, eq=False)
class SurfacePlace:
    """A place on a face of a surface."""

    face: int
    barycentric: Floats  # (3,)

    def on(self, surface: SurfaceMesh) -> Floats:
        """Return the (3,) point, micrometres, on a surface with this face."""
        return np.asarray(self.barycentric @ surface.vertices[surface.faces[self.face]])


@dataclass(frozen=True, eq=False)
class SamePlace:
    """One place of the brain in every view."""

    source: SurfacePlace  # also on the registered surface, which has the same faces
    target: SurfacePlace
    half: HalfName | None  # None: on a trim cap
    plane: Floats | None  # (2,), in the rectangle of the half


class BrainPlaces:
    """Where places of one brain lie on its halves; kept while only the registration changes."""

    def __init__(self, brain: FlatBrain) -> None:
        self.brain = brain
        pieces = brain.dissection.piece_of_face
        self.faces_of = {half: np.flatnonzero(pieces == PIECES.index(half)) for half in HALVES}
        self._own_number = np.zeros(len(pieces), dtype=np.int64)
        for faces in self.faces_of.values():
            self._own_number[faces] = np.arange(len(faces))
        self._pieces = pieces

    def half_of(self, face: int) -> tuple[HalfName | None, int]:
        """Return the half that a face of the surface belongs to and its number there."""
        piece = PIECES[self._pieces[face]]
        half = next((half for half in HALVES if half == piece), None)
        return half, int(self._own_number[face])

    @cached_property
    def strips(self) -> dict[HalfName, TriangleGrid]:
        """What finds places of the strips of this brain's halves."""
        return {half: strip_grid(self.brain.halves[half].flat) for half in HALVES}


class DrawnHalf:
    """Finds the triangle that is drawn at a place of a half's rectangle.

    With straight sides between the places of their corners some triangles overlap, or lie upside
    down: then the last one is seen.
    """

    def __init__(self, plane: Floats, faces: Integers) -> None:
        numbers = np.arange(len(faces))[::-1]  # the grid finds the first one
        corners = plane[faces[numbers]]
        along, aside = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        turned = along[:, 0] * aside[:, 1] < along[:, 1] * aside[:, 0]
        corners[turned] = corners[turned][:, [0, 2, 1]]
        self._grid = build_grid(corners, numbers, faces)
        self._is_turned = turned[::-1]

    def find(self, point: Floats) -> SurfacePlace | None:
        """Return the triangle at a (2,) place, or the nearest one, and where in it; None far off."""
        found = _find(self._grid, point)
        if found.face < 0:
            return None
        if self._is_turned[found.face]:
            return SurfacePlace(found.face, found.barycentric[[0, 2, 1]])
        return found


class PlaceFinder:
    """Finds one place everywhere, for one registration; built in no time, grids when first asked."""

    def __init__(
        self,
        source: FlatBrain,
        target: FlatBrain,
        registration: Registration,
        before: PlaceFinder | None = None,
    ) -> None:
        kept: tuple[BrainPlaces, ...] = () if before is None else (before._source, before._target)
        self._source: BrainPlaces = _kept_or_new(source, kept)
        self._target: BrainPlaces = _kept_or_new(target, kept)
        self.registration = registration
        self._strips: dict[HalfName, TriangleGrid] = {}
        self._planes: dict[HalfName, DrawnHalf] = {}

    def from_source(self, place: SurfacePlace) -> SamePlace:
        """Return a place of the source, or of the registered surface, everywhere."""
        half, face = self._source.half_of(place.face)
        if half is None:
            point = place.on(self.registration.surface)
            return SamePlace(
                place, _nearest(point, self._target.brain.dissection.surface), None, None
            )
        warped = self.registration.halves[half]
        uv = place.barycentric @ warped.flat.corners[face]
        found = _find(self._target.strips[half], once_around(uv[None])[0])
        target = SurfacePlace(int(self._target.faces_of[half][found.face]), found.barycentric)
        plane = place.barycentric @ warped.plane[warped.flat.faces[face]]
        return SamePlace(place, target, half, plane)

    def from_target(self, place: SurfacePlace) -> SamePlace:
        """Return a place of the target everywhere."""
        half, face = self._target.half_of(place.face)
        if half is None:
            point = place.on(self._target.brain.dissection.surface)
            return SamePlace(_nearest(point, self.registration.surface), place, None, None)
        warped = self.registration.halves[half]
        uv = place.barycentric @ self._target.brain.halves[half].flat.corners[face]
        if half not in self._strips:
            self._strips[half] = strip_grid(warped.flat)
        found = _find(self._strips[half], once_around(uv[None])[0])
        source = SurfacePlace(int(self._source.faces_of[half][found.face]), found.barycentric)
        plane = found.barycentric @ warped.plane[warped.flat.faces[found.face]]
        return SamePlace(source, place, half, plane)

    def from_plane(self, half: HalfName, point: Floats) -> SamePlace | None:
        """Return a place of a half's rectangle everywhere; None outside it or in its hole.

        The source's triangle is the one that is drawn there, with straight sides between the places
        of its corners in the rectangle; at the hole's corners such a side can cross the hole.
        """
        warped = self.registration.halves[half]
        if half not in self._planes:
            self._planes[half] = DrawnHalf(warped.plane, warped.flat.faces)
        found = self._planes[half].find(point)
        if found is None:
            return None
        _, beta = from_plane(point[None])
        drawn = found.barycentric @ warped.plane[warped.flat.faces[found.face]]
        is_drawn = np.linalg.norm(drawn - point) < INSIDE
        if not is_drawn and not -INSIDE <= beta[0] <= 1 + INSIDE:
            return None
        source = SurfacePlace(int(self._source.faces_of[half][found.face]), found.barycentric)
        return self.from_source(source)


def _kept_or_new(brain: FlatBrain, kept: tuple[BrainPlaces, ...]) -> BrainPlaces:
    return next((places for places in kept if places.brain is brain), None) or BrainPlaces(brain)


def _find(grid: TriangleGrid, place: Floats) -> SurfacePlace:
    """Return the triangle of a half that a flat place lies in, and where in it."""
    face, barycentric = find_triangles(grid, place[None])
    return SurfacePlace(int(face[0]), barycentric[0])


def _nearest(point: Floats, surface: SurfaceMesh) -> SurfacePlace:
    _, face, barycentric = surface.tree.nearest(point[None])
    return SurfacePlace(int(face[0]), barycentric[0])
