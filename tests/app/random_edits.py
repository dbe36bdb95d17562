"""A user who does anything at all: every edit, and every hand of the window that makes some."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import replace
from typing import get_args

import numpy as np
from flyreg_gui.blink import Blink
from flyreg_gui.drill_mode import DrillMode
from flyreg_gui.landmark_mode import KINDS, LandmarkMode
from flyreg_gui.panels.fold_alarm import FoldAlarm
from flyreg_gui.preparing import ROLES
from flyreg_gui.selection import Selection
from flyreg_gui.trim_mode import TrimMode
from flyreg_gui.tunnels import Tunnels

from flyreg_core import edits
from flyreg_core.errors import FlyregError
from flyreg_core.landmarks import HALVES, LandmarkPair, Pairing
from flyreg_core.pose import PoseParameters
from flyreg_core.project import BrainInput, NeuropilFile


class RandomUser:
    """Changes the project of a session that has results, by any of `WAYS`."""

    def __init__(self, session) -> None:
        self.session, self.results = session, session.results
        self.selection = Selection()
        self.mode = LandmarkMode(session, self.selection)
        self.trim, self.tunnels = TrimMode(session), Tunnels(session)
        self.drill = DrillMode(session)
        self.blink = Blink(session, lambda text: None)
        self.alarm = FoldAlarm(session)
        self.mode.set_on(True)

    def act(self, rng: np.random.Generator) -> None:
        """Change the project in any way; what the program refuses changes nothing."""
        with contextlib.suppress(FlyregError):
            EVERY_WAY[rng.integers(len(EVERY_WAY))](self, rng)

    def edit(self, edit: Callable, *arguments: object) -> None:
        """Change the project by a function of `edits`."""
        self.session.edit(edit.__name__, edit(self.session.project, *arguments))

    # What there is to choose from

    def ids(self, rng, most: int = 6) -> list[str]:
        """Ids of landmarks of any kind."""
        own = [pair.id for pair in self.session.project.pairs]
        made = [mark.pair.id for mark in self.results.landmarks]
        every = [*own, *own, *own, *made]
        return [every[k] for k in rng.integers(len(every), size=rng.integers(1, most))]

    def own(self, rng) -> LandmarkPair:
        """One of the user's own pairs; there is none at first."""
        pairs = self.session.project.pairs
        if not pairs:
            raise FlyregError("there is no pair yet")
        return pairs[rng.integers(len(pairs))]

    def point(self, rng, role: str):
        """A place on one of the brains."""
        brain = self.results.source if role == "source" else self.results.target
        vertices = brain.torus.surface.vertices
        return tuple(vertices[rng.integers(len(vertices))].tolist())

    def suggested(self, rng) -> list[LandmarkPair]:
        """Some of the suggestions."""
        marks = [m.pair for m in self.results.landmarks if m.pair.origin == "suggested"]
        return [marks[k] for k in rng.permutation(len(marks))[:3]]


def _role(rng):
    return ROLES[rng.integers(2)]


def _place_pair(user, rng):
    pair = user.own(rng)
    role = _role(rng)
    place = user.point(rng, role) if pair.kind == "interior" else float(rng.uniform())
    user.edit(edits.place_pair, pair.id, role, place)


def _move_on_curve(user, rng):
    identifier = rng.choice(["upper-02", "lower-03", "hole-04", "anterior-left-01"])
    user.edit(edits.place_pair, str(identifier), "target", float(rng.uniform(-0.1, 1.1)))


def _place_end(user, rng):
    pair, role, kind = user.own(rng), _role(rng), KINDS[rng.integers(len(KINDS))]
    half = HALVES[rng.integers(2)] if kind in ("left", "right") else None
    place = user.point(rng, role) if kind == "interior" else float(rng.uniform())
    user.edit(edits.place_end, pair.id, role, kind, half, place)


def _add_pair(user, rng):
    number = int(rng.integers(40))
    ends = [user.point(rng, role) if rng.uniform() < 0.8 else None for role in ROLES]
    pair = LandmarkPair(f"own-{number}", f"Own {number}", "interior", None, *ends)
    user.edit(edits.add_pair, replace(pair, weight=float(rng.uniform(0, 9))))


def _merge_pairs(user, rng):
    pairs = [
        LandmarkPair(
            f"read-{n}", f"Own {n}", "interior", None, *(user.point(rng, r) for r in ROLES)
        )
        for n in rng.integers(40, size=3)
    ]
    user.edit(edits.merge_pairs, pairs)


def _brain(user, rng, change):
    role = _role(rng)
    brain = edits.brain_of(user.session.project, role)
    user.edit(edits.set_brain, role, change(brain))


def _set_brain(user, rng):
    changes = [
        lambda b: replace(b, solid=replace(b.solid, voxels_across=int(rng.integers(32, 40)))),
        lambda b: replace(b, smooth=replace(b.smooth, passes=int(rng.integers(300, 600)))),
        lambda b: replace(b, simplify=replace(b.simplify, vertices=int(rng.integers(4000, 6000)))),
        lambda b: replace(b, pose=PoseParameters("LVP")),
        lambda b: replace(b, input=replace(b.input, unit_known_by="stated by the user")),
    ]
    _brain(user, rng, changes[rng.integers(len(changes))])


def _prepare_both(user, rng):
    project = user.session.project
    pairings = get_args(Pairing)
    boundary = replace(
        project.boundary,
        per_seam=int(rng.integers(4, 12)),
        per_side=int(rng.integers(1, 5)),
        pairing=pairings[rng.integers(len(pairings))],
    )
    user.session.edit("change preparation", replace(project, boundary=boundary))


def _neuropils(user, rng):
    path = f"/neuropils/{rng.integers(5)}.ply"
    given = BrainInput(path, path, "0" * 64, "um", "as the source brain")
    user.edit(edits.add_neuropils, NeuropilFile(given, _role(rng)))


def _tunnel(user, rng, *, take):
    role = _role(rng)
    count = len(user.tunnels.of(role))
    if count:
        user.tunnels.choose((role, int(rng.integers(count))))
        (user.tunnels.take if take else user.tunnels.refuse)()


def _drill(user, rng):
    role = _role(rng)
    user.drill.set_on(True)
    user.drill.place(role, user.point(rng, role))
    user.drill.place(role, user.point(rng, role))


def _drag_landmark(user, rng):
    role = _role(rng)
    if user.mode.grab(user.ids(rng)[0], role):
        for _ in range(rng.integers(1, 5)):
            user.mode.drag(user.point(rng, role))
        user.mode.let_go()


def _click(user, rng):
    user.mode.set_kind(KINDS[rng.integers(len(KINDS))])
    user.mode.place("source", user.point(rng, "source"))
    if rng.uniform() < 0.7:
        user.mode.place("target", user.point(rng, "target"))
    elif rng.uniform() < 0.5:
        user.mode.abandon()
    user.mode.skip()


def _drag_weight(user, rng):
    ids = user.ids(rng)
    user.session.begin_gesture()
    for weight in rng.uniform(0.01, 50, size=4):
        user.edit(edits.set_weights, ids, float(weight))
    user.session.end_gesture()


def _drag_smoothing(user, rng):
    user.session.begin_gesture()
    first = user.session.project.smoothing
    for smoothing in (*(10.0 ** rng.uniform(-4, 1, size=4)).tolist(), first)[: rng.integers(2, 6)]:
        user.edit(edits.set_smoothing, smoothing)  # now and then back to where it was
    user.session.end_gesture()


def _drag_plane(user, rng):
    role, knob = _role(rng), ("right", "left", "cut")[rng.integers(3)]
    user.trim.set_on(True)
    user.trim.grab(role, knob)
    places = user.trim.places(role)
    user.trim.drag_to(places.of(knob) + float(rng.normal(scale=6)))
    (user.trim.release if rng.uniform() < 0.8 else user.trim.abandon)()


def _fold_remedy(user, rng):
    (user.alarm.weaken if rng.uniform() < 0.5 else user.alarm.raise_smoothing)()


def _snapshot(rng):
    return "AB"[rng.integers(2)]


WAYS: dict[str, Callable] = {
    "set_weight": lambda u, r: u.edit(edits.set_weight, u.ids(r)[0], float(r.uniform(0, 20))),
    "set_weights": lambda u, r: u.edit(edits.set_weights, u.ids(r), float(r.uniform(0, 20))),
    "set_each_weight": lambda u, r: u.edit(
        edits.set_each_weight, {name: float(r.uniform(0, 20)) for name in u.ids(r)}
    ),
    "set_weights below 0": lambda u, r: u.edit(edits.set_weights, u.ids(r), -1.0),
    "set_muted": lambda u, r: u.edit(edits.set_muted, u.ids(r), bool(r.integers(2))),
    "set_solo": lambda u, r: u.edit(edits.set_solo, u.ids(r) if r.uniform() < 0.6 else []),
    "set_smoothing": lambda u, r: u.edit(edits.set_smoothing, float(10 ** r.uniform(-6, 2))),
    "add_pair": _add_pair,
    "remove_pairs": lambda u, r: u.edit(edits.remove_pairs, u.ids(r)),
    "merge_pairs": _merge_pairs,
    "add_unplaced": lambda u, r: u.edit(
        edits.add_unplaced, [f"Own {n}" for n in r.integers(40, size=2)]
    ),
    "recolor_pairs": lambda u, r: u.edit(
        edits.recolor_pairs, u.ids(r), tuple(r.integers(256, size=3).tolist())
    ),
    "add_neuropils": _neuropils,
    "accept_suggestions": lambda u, r: u.edit(edits.accept_suggestions, u.suggested(r)),
    "rename_pair": lambda u, r: u.edit(edits.rename_pair, u.own(r).id, f"Own {r.integers(40)}"),
    "place_pair": _place_pair,
    "place_pair on a curve": _move_on_curve,
    "place_end": _place_end,
    "keep_snapshot": lambda u, r: u.blink.keep(_snapshot(r)),
    "take_snapshot": lambda u, r: u.edit(edits.take_snapshot, _snapshot(r)),
    "take a snapshot": lambda u, r: u.blink.take(_snapshot(r)),
    "set_brain": _set_brain,
    "change preparation": _prepare_both,
    "set_oesophagus": lambda u, r: _tunnel(u, r, take=True),
    "close_tunnel": lambda u, r: _tunnel(u, r, take=False),
    "add_drill": _drill,
    "reset_handles": lambda u, r: u.tunnels.reset(),
    "set_trim_plane": lambda u, r: u.edit(
        edits.set_trim_plane, _role(r), ("right", "left")[r.integers(2)], None
    ),
    "set_cut_shift": lambda u, r: u.edit(edits.set_cut_shift, _role(r), float(r.normal(scale=3))),
    "reset_trimming": lambda u, r: u.trim.reset_all(),
    "as_in_the_paper": lambda u, r: u.edit(edits.as_in_the_paper),
    "click": _click,
    "drag a landmark": _drag_landmark,
    "drag a weight": _drag_weight,
    "drag the smoothing": _drag_smoothing,
    "drag a plane": _drag_plane,
    "remedy of the fold alarm": _fold_remedy,
    "undo": lambda u, r: u.session.undo_stack.undo(),
    "redo": lambda u, r: u.session.undo_stack.redo(),
}
"""Every way to change a project, those of the hand with gestures included."""
EVERY_WAY = tuple(WAYS.values())
