"""Trimming: where the planes and the cut of each brain are, and the hand that moves one of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from PySide6.QtCore import QObject, Signal

from flyreg_core import edits
from flyreg_core.frame import LEFT_RIGHT
from flyreg_core.mesh import Booleans, Floats
from flyreg_core.project import Role
from flyreg_gui.preparing import ROLES
from flyreg_gui.session import Session

Knob = Literal["right", "left", "cut"]
NAMES = {"right": "right trim plane", "left": "left trim plane", "cut": "cut"}
DIGITS = 1
"""Places are rounded to tenths of micrometres."""
LEAST_KEPT = 20.0
"""How far apart the planes stay, micrometres."""
UNKNOWN_SHARE = 0.55
"""Where planes are shown that were never found, as a share of the way from the middle to a side."""


@dataclass(frozen=True, eq=False)
class TrimPlaces:
    """Where the planes and the cut are, in the frame of the animal."""

    right: float
    left: float
    shift: float
    knots: Floats | None  # (k, 2), left-right and antero-posterior; None where no cut was found

    def of(self, knob: Knob) -> float:
        """Return the number that a knob changes."""
        return self.shift if knob == "cut" else self.right if knob == "right" else self.left


class TrimMode(QObject):
    """Whether planes and cut are shown, and which one is being dragged to where."""

    changed = Signal()
    dragged = Signal(str)  # role

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.is_on = False
        self._held: tuple[Role, Knob] | None = None
        self._value = 0.0
        session.project_changed.connect(self._on_news)
        session.results_changed.connect(self._on_news)
        session.remains_changed.connect(self._on_news)

    def set_on(self, on: bool) -> None:
        """Enter or leave the mode."""
        if on != self.is_on:
            self.is_on, self._held = on, None
            self.changed.emit()

    def places(self, role: Role) -> TrimPlaces | None:
        """Return where planes and cut are: what the user said, or else what was found."""
        brain, project = self._session.brain(role), self._session.project
        if brain is None or project is None:
            return None
        wanted = edits.brain_of(project, role)
        if brain.prepared is not None:
            planes, dissection = brain.prepared.torus.planes, brain.prepared.flat.dissection
            found = (planes.right, planes.left)
            knots = dissection.cut_knots - np.array([0.0, brain.prepared.brain.cut.shift_um])
        else:
            x = brain.frame.coordinates(brain.raw.vertices)[:, LEFT_RIGHT]
            found, knots = (UNKNOWN_SHARE * float(x.min()), UNKNOWN_SHARE * float(x.max())), None
        values: dict[Knob, float] = {
            "right": found[0] if wanted.trim.right is None else wanted.trim.right,
            "left": found[1] if wanted.trim.left is None else wanted.trim.left,
            "cut": wanted.cut.shift_um,
        }
        if self._held is not None and self._held[0] == role:
            values[self._held[1]] = self._value
        if knots is not None:
            knots = knots + np.array([0.0, values["cut"]])
        return TrimPlaces(values["right"], values["left"], values["cut"], knots)

    # The hand

    def grab(self, role: Role, knob: Knob) -> None:
        """Take hold of a plane or the cut."""
        places = self.places(role)
        if places is not None:
            self._held, self._value = (role, knob), places.of(knob)

    def drag_to(self, value: float) -> None:
        """Move what is held; nothing is decided before it is let go."""
        if self._held is None:
            return
        role, knob = self._held
        places = self.places(role)
        if places is not None:
            if knob == "right":
                value = min(value, places.left - LEAST_KEPT)
            elif knob == "left":
                value = max(value, places.right + LEAST_KEPT)
            self._value = round(value, DIGITS)
            self.dragged.emit(role)

    def release(self) -> None:
        """Let go; what was held stays where it is."""
        if self._held is None:
            return
        (role, knob), self._held = self._held, None
        places = self.places(role)
        if places is not None and self._value != places.of(knob):
            self._edit(role, knob, self._value)
        self.changed.emit()

    def abandon(self) -> bool:
        """Put back what is held, or else leave the mode; tell whether there was anything to end."""
        if self._held is not None:
            self._held = None
            self.changed.emit()
            return True
        was_on = self.is_on
        self.set_on(False)
        return was_on

    def reset(self, role: Role, knob: Knob) -> None:
        """Leave one plane or the cut to the program again."""
        self._held = None
        self._edit(role, knob, None)

    def reset_all(self) -> None:
        """Leave the planes and the cuts of both brains to the program again."""
        project = self._session.project
        if project is not None:
            for role in ROLES:
                project = edits.reset_trimming(project, role)
            self._session.edit("leave trimming and cut to the program", project)

    def _edit(self, role: Role, knob: Knob, value: float | None) -> None:
        project = self._session.project
        if project is None:
            return
        if knob == "cut":
            changed = edits.set_cut_shift(project, role, value or 0.0)
        else:
            changed = edits.set_trim_plane(project, role, knob, value)
        self._session.edit(f"move the {NAMES[knob]} of the {role}", changed)

    @property
    def next_step(self) -> str:
        """Where what is held is now, or what the user is to do, for the status bar."""
        if not self.is_on:
            return ""
        if self._held is None:
            return "Trimming: drag a dot; double-click it for the automatic place (P or Esc ends)"
        role, knob = self._held
        return f"{NAMES[knob][0].upper()}{NAMES[knob][1:]} of the {role}: {describe(knob, self._value)}"

    def _on_news(self, _news: object) -> None:
        if self._session.brain("source") is None and self._session.brain("target") is None:
            self.set_on(False)
        elif self.is_on:
            self.changed.emit()


def describe(knob: Knob, value: float) -> str:
    """Return a place in words."""
    if knob == "cut":
        if not value:
            return "at the automatic place"
        return f"{abs(value):.1f} µm {'behind' if value > 0 else 'before'} the automatic place"
    return f"{abs(value):.1f} µm {'left' if value > 0 else 'right'} of the midplane"


def label_of(knob: Knob, value: float) -> str:
    """Return a place as short as can be, for a label."""
    if knob == "cut":
        return f"cut {value:+.0f} µm" if value else "cut"
    return f"{abs(value):.0f} µm {'L' if value > 0 else 'R'}"


def beyond(coordinates: Floats, places: TrimPlaces) -> Booleans:
    """Return (n,) which points of the frame, (n, 3), the planes cut off."""
    x = coordinates[:, LEFT_RIGHT]
    return np.asarray((x < places.right) | (x > places.left))
