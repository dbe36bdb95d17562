"""The tunnels of both brains: which one is pointed at, and what the user says about it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QObject, Signal

from flyreg_core import edits
from flyreg_core.frame import ANTERO_POSTERIOR, DORSO_VENTRAL, LEFT_RIGHT, BrainFrame
from flyreg_core.handles import Handle, HandleParameters
from flyreg_core.project import Role
from flyreg_core.results import Results
from flyreg_gui.preparing import ROLES

if TYPE_CHECKING:
    from flyreg_gui.session import Session

Chosen = tuple[Role, int]

RUNS = {LEFT_RIGHT: "side to side", DORSO_VENTRAL: "up and down", ANTERO_POSTERIOR: "front to back"}
OBLIQUE = 0.75
"""Least share of a direction along its main axis for it not to be called oblique."""


class Tunnels(QObject):
    """Whether tunnels are shown, which one is chosen, and the edits that begin with one."""

    changed = Signal()

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.is_on = False
        self.chosen: Chosen | None = None
        self._known: list[tuple[object, ...]] = []
        session.results_changed.connect(self._on_news)
        session.remains_changed.connect(self._on_news)

    def set_on(self, on: bool) -> None:
        """Show or hide the tunnels."""
        if on != self.is_on:
            self.is_on = on
            self.changed.emit()

    def choose(self, chosen: Chosen | None) -> None:
        """Point at one tunnel of a brain, or at none."""
        if chosen is not None and chosen[1] >= len(self.of(chosen[0])):
            chosen = None
        if chosen != self.chosen:
            self.chosen = chosen
            self.changed.emit()

    def of(self, role: Role) -> tuple[Handle, ...]:
        """Return the tunnels of a brain, the widest first."""
        brain = self._session.brain(role)
        return brain.tunnels if brain is not None else ()

    @property
    def tunnel(self) -> Handle | None:
        """The chosen tunnel."""
        if self.chosen is None:
            return None
        return self.of(self.chosen[0])[self.chosen[1]]

    def take(self) -> None:
        """Say that the chosen tunnel is the oesophagus."""
        project, tunnel = self._session.project, self.tunnel
        if project is not None and tunnel is not None and self.chosen is not None:
            role = self.chosen[0]
            changed = edits.set_oesophagus(project, role, tunnel.center_um)
            self._session.edit(f"choose the oesophagus of the {role}", changed)

    def refuse(self) -> None:
        """Say that the chosen tunnel is not the oesophagus."""
        project, tunnel = self._session.project, self.tunnel
        if project is not None and tunnel is not None and self.chosen is not None:
            role = self.chosen[0]
            changed = edits.close_tunnel(project, role, tunnel)
            self._session.edit(f"refuse a tunnel of the {role}", changed)

    def reset(self) -> None:
        """Leave the tunnels of both brains to the program again."""
        project = self._session.project
        if project is not None:
            for role in ROLES:
                project = edits.reset_handles(project, role)
            self._session.edit("leave the tunnels to the program", project)

    @property
    def can_reset(self) -> bool:
        """Tell whether the user said anything about tunnels."""
        project = self._session.project
        untouched = HandleParameters()
        return project is not None and any(
            edits.brain_of(project, role).handles != untouched for role in ROLES
        )

    def _on_news(self, _news: object) -> None:
        """Tell of other tunnels, not of all that follows a slider: the brains would be drawn anew."""
        brains = [self._session.brain(role) for role in ROLES]
        known: list[tuple[object, ...]] = [
            () if b is None else (b.raw, b.frame, b.tunnels, b.is_guess) for b in brains
        ]
        if known != self._known:
            self._known, self.chosen = known, None
            self.changed.emit()


def guess_of(results: Results) -> tuple[str, object] | None:
    """Return the sentence that a guess deserves, and what it is about; None if all is sure."""
    guessed = [
        (role, brain.torus.oesophagus.center_um)
        for role, brain in zip(ROLES, (results.source, results.target), strict=True)
        if brain.torus.is_guess
    ]
    if not guessed:
        return None
    whose = " and ".join(f"the {role}" for role, _ in guessed)
    sentence = (
        f"the oesophagus of {whose} is a guess; see whether it is the right tunnel, and point at "
        "another one or drill it where it is not"
    )
    return sentence, tuple(guessed)


def name_of(tunnel: Handle, number: int, is_guess: bool) -> str:
    """Return what a tunnel is called: its number, what it is, and "?" for a guess."""
    if tunnel.is_oesophagus:
        return f"{number} oesophagus{' ?' if is_guess else ''}"
    return f"{number} candidate" if tunnel.is_candidate else str(number)


def place_of(tunnel: Handle, frame: BrainFrame) -> str:
    """Return how far a tunnel lies from the middle of the brain, in whole micrometres."""
    x, y, z = (round(float(v)) for v in frame.coordinates(np.array(tunnel.center_um)))
    parts = ((x, "L", "R"), (y, "V", "D"), (z, "P", "A"))
    return " ".join(f"{plus if value > 0 else minus}{abs(value)}" for value, plus, minus in parts)


def course_of(tunnel: Handle, frame: BrainFrame) -> str:
    """Return in words which way a tunnel runs."""
    along = np.abs(frame.axes @ np.array(tunnel.direction))
    axis = int(along.argmax())
    return RUNS[axis] if along[axis] >= OBLIQUE else f"obliquely {RUNS[axis]}"


def description_of(tunnel: Handle, frame: BrainFrame, is_guess: bool) -> str:
    """Return in words where a tunnel lies, how wide it is, and which way it runs."""
    what = "candidate" if tunnel.is_candidate else "tunnel"
    if tunnel.is_oesophagus:
        what = "the program's guess" if is_guess else "the oesophagus"
    where = "near the midline" if tunnel.is_near_midline else "away from the midline"
    return (
        f"{what[0].upper()}{what[1:]}: {tunnel.width_um:.1f} µm wide, {where}, runs "
        f"{course_of(tunnel, frame)}"
    )
