"""Landmark mode: a click on one brain and a click on the other make a landmark pair."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

import numpy as np
from PySide6.QtCore import QObject, Signal

from flyreg_core import edits
from flyreg_core.boundary import curve_key
from flyreg_core.correspondence import FlatBrain
from flyreg_core.landmarks import (
    CORNERS,
    HALVES,
    CurveName,
    HalfName,
    Kind,
    LandmarkPair,
    Place,
    kept_in_order,
)
from flyreg_core.project import Project, Role
from flyreg_gui.selection import Selection
from flyreg_gui.session import Session

Point = tuple[float, float, float]
KINDS: tuple[Kind, ...] = get_args(Kind)


@dataclass(frozen=True)
class Spot:
    """Where a click puts an end of a landmark: on the surface, or on a curve of it."""

    kind: Kind
    half: HalfName | None
    place: Place

    @classmethod
    def at(cls, point: Point, brain: FlatBrain, kind: Kind, half: HalfName | None = None) -> Spot:
        """Return the spot nearest to a point; on the curve of either half if `half` says none."""
        if kind == "interior":
            return cls(kind, None, point)
        name: CurveName = kind
        halves = HALVES if half is None else (half,)
        keys = dict.fromkeys(curve_key(name, each) for each in halves)
        found = {key: brain.curves[key].nearest(np.array(point)) for key in keys}
        key = min(found, key=lambda key: found[key][1])
        return cls(kind, key[1], found[key][0])


class LandmarkMode(QObject):
    """Whether clicks make landmarks, and which pair the next click goes to.

    A pair that is not placed on both brains is a part of the project like any other. The selected
    one is placed by the next clicks; if none such is selected, a click begins a new pair.
    """

    changed = Signal()

    def __init__(
        self, session: Session, selection: Selection, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._session, self._selection = session, selection
        self.is_on = False
        self.kind: Kind = "interior"  # of the pairs that clicks begin
        self._begun: str | None = None  # id of the pair that a click began
        self._grabbed: tuple[str, Role] | None = None
        session.results_changed.connect(self._on_results)
        session.project_changed.connect(self._on_news)
        selection.changed.connect(self._on_news)

    def set_on(self, on: bool) -> None:
        """Enter or leave the mode; a half-made pair stays, and can be finished later."""
        if on != self.is_on:
            self.is_on = on
            self._begun = None
            self.changed.emit()

    def set_kind(self, kind: Kind) -> None:
        """Have clicks begin pairs on the surface, or on one of the curves."""
        self.kind = kind
        self.changed.emit()

    @property
    def unplaced(self) -> list[LandmarkPair]:
        """The pairs that are not placed on both brains, in the project's order."""
        project = self._session.project
        return [] if project is None else [pair for pair in project.pairs if not pair.is_placed]

    @property
    def current(self) -> LandmarkPair | None:
        """The pair that the next click goes to; None: it begins a new one."""
        chosen = self._selection.current
        return next((pair for pair in self.unplaced if pair.id == chosen), None)

    @property
    def kind_now(self) -> Kind:
        """Where the next click puts a landmark."""
        current = self.current
        return self.kind if current is None or not _has_end(current) else current.kind

    def abandon(self) -> bool:
        """Take a half-made pair back that a click began; tell whether there was one."""
        current, project = self.current, self._session.project
        if not self.is_on or current is None or project is None or current.id != self._begun:
            return False
        self._begun = None
        self._session.edit(f"abandon {current.name}", edits.remove_pairs(project, [current.id]))
        return True

    def skip(self) -> None:
        """Go on to the next pair that is not placed on both brains."""
        unplaced = [pair.id for pair in self.unplaced]
        if unplaced:
            chosen = self._selection.current
            after = unplaced.index(chosen) + 1 if chosen in unplaced else 0
            self._selection.select([unplaced[after % len(unplaced)]])

    def place(self, role: Role, point: Point) -> None:
        """Take a point on one of the brains for an end of the current pair, or of a new one."""
        project, results = self._session.project, self._session.results
        if not self.is_on or project is None or results is None:
            return
        brain = results.source if role == "source" else results.target
        pair = self.current
        kind, half = self.kind_now, None if pair is None else pair.half
        spot = Spot.at(point, brain.flat, kind, half)
        if pair is None:
            pair = _new_pair(project, spot)
            project = edits.add_pair(project, pair)
            self._begun = pair.id
        placed = edits.place_end(project, pair.id, role, spot.kind, spot.half, spot.place)
        self._session.edit(f"place {pair.name} on the {role}", placed)
        self._selection.select([self._next_after(pair.id)])
        self.changed.emit()

    def _next_after(self, identifier: str) -> str:
        """Return the pair to place after a click: the same one until it has both ends.

        Then the next one of a list whose places are still to be clicked, if it is from a list.
        """
        pairs = self._session.project.pairs if self._session.project is not None else ()
        row = next(row for row, pair in enumerate(pairs) if pair.id == identifier)
        is_from_list = self._begun != identifier
        if not pairs[row].is_placed:
            return identifier
        self._begun = None
        later = (pair.id for pair in pairs[row:] if not pair.is_placed)
        return next(later, identifier) if is_from_list else identifier

    # Dragging

    def grab(self, identifier: str, role: Role) -> bool:
        """Take hold of one end of a landmark; tell whether it can be moved."""
        pair = self._pair(identifier)
        if not self.is_on or pair is None or identifier in CORNERS:
            return False
        if pair.origin == "boundary" and role == "source":
            return False
        self._session.begin_gesture()
        self._grabbed = (identifier, role)
        return True

    def drag(self, point: Point) -> None:
        """Move the end that was grabbed to the place of its surface, or curve, nearest to a point.

        A suggestion that is moved becomes the user's own.
        """
        project, results = self._session.project, self._session.results
        if self._grabbed is None or project is None or results is None:
            return
        identifier, role = self._grabbed
        pair = self._pair(identifier)
        if pair is None:
            return
        if pair.origin == "suggested":
            project = edits.accept_suggestions(project, [pair])
            pair = project.pairs[-1]
            self._grabbed = (pair.id, role)
        brain = results.source if role == "source" else results.target
        place = Spot.at(point, brain.flat, pair.kind, pair.half).place
        if isinstance(place, float) and role == "target":
            place = kept_in_order(place, pair, [mark.pair for mark in results.landmarks])
        moved = edits.place_pair(project, pair.id, role, place)
        self._session.edit(f"move {pair.name} on the {role}", moved)
        self._selection.select([pair.id])

    def _pair(self, identifier: str) -> LandmarkPair | None:
        """Return the pair with an id as the project has it now, or else as it was made."""
        project, results = self._session.project, self._session.results
        own = () if project is None else project.pairs
        made = () if results is None else tuple(mark.pair for mark in results.landmarks)
        return next((pair for pair in (*own, *made) if pair.id == identifier), None)

    def is_own(self, identifier: str) -> bool:
        """Tell whether a landmark is the user's own."""
        pair = self._pair(identifier)
        return pair is not None and pair.origin == "user"

    def let_go(self) -> None:
        """End a drag."""
        self._grabbed = None
        self._session.end_gesture()

    @property
    def next_step(self) -> str:
        """What the user is to do now, for the status bar."""
        if not self.is_on:
            return ""
        pair, where = self.current, _where(self.kind_now)
        if pair is None:
            return f"Landmark mode: click {where} on the source or the target (Space ends the mode)"
        left = len(self.unplaced)
        others = f"; {left} still to place, Ctrl+D skips" if left > 1 else ""
        role: Role | None = (
            "target" if pair.source is not None else "source" if pair.target is not None else None
        )
        brain = f"the {role}" if role else "either brain"
        back = ", Esc takes it back" if pair.id == self._begun else ""
        return f"Landmark mode: click {where} of {pair.name} on {brain}{back}{others}"

    def _on_results(self, results: object) -> None:
        if results is None:
            self.set_on(False)

    def _on_news(self, *_news: object) -> None:
        if self.is_on:
            self.changed.emit()


def _where(kind: Kind) -> str:
    return "the place" if kind == "interior" else f"the place on the {kind} curve"


def _has_end(pair: LandmarkPair) -> bool:
    return pair.source is not None or pair.target is not None


def _new_pair(project: Project, spot: Spot) -> LandmarkPair:
    """Return a pair to be placed, with the first name and id that are free."""
    ids, names = {pair.id for pair in project.pairs}, {pair.name for pair in project.pairs}
    number = next(
        n
        for n in range(1, len(project.pairs) + 2)
        if f"user-{n}" not in ids and f"Landmark {n}" not in names
    )
    name = f"Landmark {number}"
    return LandmarkPair(f"user-{number}", name, spot.kind, spot.half, None, None)


def end_point(pair: LandmarkPair, role: Role, brain: FlatBrain) -> Point | None:
    """Return where one end of a pair lies in space; None if it is still to be placed."""
    place: Place | None = pair.source if role == "source" else pair.target
    if place is None or isinstance(place, tuple):
        return place
    x, y, z = brain.curves[pair.kind, pair.half].at(np.array([place]))[0].tolist()  # type: ignore[index]
    return x, y, z
