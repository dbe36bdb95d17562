"""What a user can do to a project: one function each, from project to project."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Literal

from flyreg_core.errors import LandmarkError
from flyreg_core.flatten import FlattenParameters
from flyreg_core.handles import Handle, HandleParameters, Point
from flyreg_core.landmarks import HalfName, Kind, LandmarkPair, Place
from flyreg_core.project import Brain, NeuropilFile, Project, Role, Snapshot
from flyreg_core.trim import TrimParameters

PASSES_OF_THE_PAPER = 500
Side = Literal["right", "left"]


def set_weight(project: Project, identifier: str, weight: float) -> Project:
    """Change how strongly one landmark pair pulls; 0 leaves it out."""
    return set_weights(project, [identifier], weight)


def set_weights(project: Project, identifiers: Iterable[str], weight: float) -> Project:
    """Give several landmark pairs the same weight."""
    return set_each_weight(project, dict.fromkeys(identifiers, weight))


def set_each_weight(project: Project, weights: Mapping[str, float]) -> Project:
    """Give several landmark pairs a weight each, by id."""
    own = {pair.id for pair in project.pairs}
    return replace(
        project,
        pairs=tuple(
            replace(pair, weight=weights[pair.id]) if pair.id in weights else pair
            for pair in project.pairs
        ),
        weights={
            **project.weights,
            **{pair: weight for pair, weight in sorted(weights.items()) if pair not in own},
        },
    )


def set_muted(project: Project, identifiers: Iterable[str], muted: bool) -> Project:
    """Have pairs keep their weights without pulling, or pull again."""
    chosen = set(identifiers)
    kept = set(project.muted) | chosen if muted else set(project.muted) - chosen
    return replace(project, muted=tuple(sorted(kept)))


def set_solo(project: Project, identifiers: Iterable[str]) -> Project:
    """Have only these pairs pull, and the corners; none of them: all pull again."""
    return replace(project, solo=tuple(sorted(set(identifiers))))


def set_smoothing(project: Project, smoothing: float) -> Project:
    """Change lambda: 0 passes through every landmark, large values leave an affine map."""
    return replace(project, smoothing=smoothing)


def add_pair(project: Project, pair: LandmarkPair) -> Project:
    """Add a landmark pair of the user's own.

    Raises
    ------
    LandmarkError
        Its id or name is taken.
    """
    for other in project.pairs:
        if pair.id == other.id or pair.name == other.name:
            raise LandmarkError(
                f"there is a landmark named {other.name} already; choose another name"
            )
    return replace(project, pairs=(*project.pairs, pair))


def remove_pairs(project: Project, identifiers: Iterable[str]) -> Project:
    """Remove pairs of the user's own; pairs on the boundary are left out by weight 0 instead."""
    chosen = set(identifiers)
    own = {pair.id for pair in project.pairs}
    kept = replace(
        project,
        pairs=tuple(pair for pair in project.pairs if pair.id not in chosen),
        muted=tuple(pair for pair in project.muted if pair not in chosen & own),
        solo=tuple(pair for pair in project.solo if pair not in chosen & own),
    )
    return set_weights(kept, chosen - own, 0.0) if chosen - own else kept


def merge_pairs(project: Project, pairs: Iterable[LandmarkPair]) -> Project:
    """Take pairs of a file over: one of a name that is known moves its ends, others are added."""
    for pair in pairs:
        known = next((own for own in project.pairs if own.name == pair.name), None)
        if known is None:
            taken = {own.id for own in project.pairs}
            project = add_pair(project, replace(pair, id=_free_id(pair.id, taken)))
            continue
        ends = {"source": pair.source or known.source, "target": pair.target or known.target}
        moved = replace(pair, id=known.id, color=known.color, **ends)  # type: ignore[arg-type]
        project = _replace_pair(project, known.id, **vars(moved))
    return project


def _free_id(wanted: str, taken: set[str]) -> str:
    return next(
        name
        for number in range(len(taken) + 1)
        if (name := wanted if number == 0 else f"{wanted}-{number}") not in taken
    )


def add_unplaced(project: Project, names: Iterable[str]) -> Project:
    """Add a pair that is still to be placed for each name that no pair has."""
    known = {pair.name for pair in project.pairs}
    new = (
        LandmarkPair(f"user-{name}", name, "interior", None, None, None)
        for name in dict.fromkeys(names)
        if name not in known
    )
    return merge_pairs(project, new)


def recolor_pairs(
    project: Project, identifiers: Iterable[str], color: tuple[int, int, int] | None
) -> Project:
    """Give pairs of the user's own a colour (red, green, blue; 0 to 255), or that of their kind."""
    for identifier in identifiers:
        project = _replace_pair(project, identifier, color=color)
    return project


def add_neuropils(project: Project, file: NeuropilFile) -> Project:
    """Add a file with neuropils."""
    return replace(project, neuropils=tuple(dict.fromkeys((*project.neuropils, file))))


def accept_suggestions(project: Project, suggested: Iterable[LandmarkPair]) -> Project:
    """Make suggested pairs the user's own, of weight 1; the suggestions themselves are left out."""
    for pair in suggested:
        identifier, name = f"accepted-{pair.id}", pair.short_name
        own = replace(pair, id=identifier, name=name, weight=1.0, origin="user")
        project = set_weight(add_pair(project, own), pair.id, 0.0)
    return project


def rename_pair(project: Project, identifier: str, name: str) -> Project:
    """Rename a pair of the user's own.

    Raises
    ------
    LandmarkError
        The name is empty or taken.
    """
    if not name.strip():
        raise LandmarkError("a landmark needs a name")
    if any(pair.name == name and pair.id != identifier for pair in project.pairs):
        raise LandmarkError(f"there is a landmark named {name} already; choose another name")
    return _replace_pair(project, identifier, name=name)


def place_pair(project: Project, identifier: str, role: Role, place: Place) -> Project:
    """Move one end of a pair; of a boundary pair only the target end moves, along its curve."""
    if any(pair.id == identifier for pair in project.pairs):
        return _replace_pair(project, identifier, **{role: place})
    if role == "source" or not isinstance(place, float):
        raise LandmarkError(
            "a boundary landmark moves only along its curve, and only on the target"
        )
    return replace(project, moved={**project.moved, identifier: min(max(place, 0.0), 1.0)})


def place_end(
    project: Project,
    identifier: str,
    role: Role,
    kind: Kind,
    half: HalfName | None,
    place: Place,
) -> Project:
    """Place one end of a pair of the user's own, which may change its kind while it has no other.

    Raises
    ------
    LandmarkError
        Its other end lies on another curve, or on none.
    """
    pair = next(own for own in project.pairs if own.id == identifier)
    other = pair.target if role == "source" else pair.source
    if other is not None and (pair.kind, pair.half) != (kind, half):
        raise LandmarkError(f"landmark {pair.name} is {pair.kind} and cannot be {kind} as well")
    if other is None:
        pair = replace(pair, kind=kind, half=half, source=None, target=None)
    placed = replace(pair, **{role: place})  # type: ignore[arg-type]
    return _replace_pair(project, identifier, **vars(placed))


def keep_snapshot(project: Project, name: str) -> Project:
    """Remember under a name how strongly landmarks pull now, and the smoothing."""
    own = {pair.id: pair.weight for pair in project.pairs}
    kept = Snapshot(project.weights, own, project.smoothing, project.muted, project.solo)
    return replace(project, snapshots={**project.snapshots, name: kept})


def take_snapshot(project: Project, name: str) -> Project:
    """Go back to the weights and the smoothing of a snapshot.

    The user's own pairs that came since keep their weight.

    Raises
    ------
    LandmarkError
        There is no snapshot of that name.
    """
    kept = project.snapshots.get(name)
    if kept is None:
        raise LandmarkError(f"nothing is kept as {name} yet; keep the weights as {name} first")
    pairs = tuple(
        replace(pair, weight=kept.pair_weights.get(pair.id, pair.weight)) for pair in project.pairs
    )
    return replace(
        project,
        pairs=pairs,
        weights=kept.weights,
        muted=kept.muted,
        solo=kept.solo,
        smoothing=kept.smoothing,
    )


def set_brain(project: Project, role: Role, brain: Brain) -> Project:
    """Change how one brain is prepared, or which brain it is."""
    return replace(project, source=brain) if role == "source" else replace(project, target=brain)


def brain_of(project: Project, role: Role) -> Brain:
    """Return one of the two brains."""
    return project.source if role == "source" else project.target


def set_oesophagus(project: Project, role: Role, place: Point) -> Project:
    """Take the tunnel nearest to a place of the file, in micrometres, for the oesophagus."""
    handles = brain_of(project, role).handles
    closed = tuple(other for other in handles.closed if other != place)
    return _with_handles(project, role, replace(handles, hole=place, closed=closed))


def close_tunnel(project: Project, role: Role, tunnel: Handle) -> Project:
    """Say that a tunnel is not the oesophagus; one that was drilled is filled again instead."""
    handles = brain_of(project, role).handles
    if tunnel.is_oesophagus and handles.drills and handles.hole is None:
        return _with_handles(project, role, replace(handles, drills=()))
    hole = None if tunnel.is_oesophagus else handles.hole
    closed = tuple(dict.fromkeys((*handles.closed, tunnel.center_um)))
    return _with_handles(project, role, replace(handles, hole=hole, closed=closed))


def add_drill(project: Project, role: Role, front: Point, back: Point) -> Project:
    """Drill a straight channel between two places of the file and take it for the oesophagus."""
    handles = brain_of(project, role).handles
    drills = (*handles.drills, (front, back))
    return _with_handles(project, role, replace(handles, hole=None, drills=drills))


def reset_handles(project: Project, role: Role) -> Project:
    """Leave it to the program again which tunnel is the oesophagus."""
    return _with_handles(project, role, HandleParameters())


def set_trim_plane(project: Project, role: Role, side: Side, place_um: float | None) -> Project:
    """Put a trim plane so far to the left of the midplane; None leaves it to the program."""
    brain = brain_of(project, role)
    return set_brain(project, role, replace(brain, trim=replace(brain.trim, **{side: place_um})))


def set_cut_shift(project: Project, role: Role, shift_um: float) -> Project:
    """Divide the halves so far behind the automatic place."""
    brain = brain_of(project, role)
    return set_brain(project, role, replace(brain, cut=replace(brain.cut, shift_um=shift_um)))


def reset_trimming(project: Project, role: Role) -> Project:
    """Leave the trim planes and the cut of a brain to the program again."""
    project = set_cut_shift(project, role, 0.0)
    return set_brain(project, role, replace(brain_of(project, role), trim=TrimParameters()))


def as_in_the_paper(project: Project) -> Project:
    """Follow the paper to the letter: each brain by itself, averaging passes, nearest vertices.

    Anatomy then ends tens of micrometres from where it belongs; this is for comparison.
    """
    flatten = FlattenParameters(passes=PASSES_OF_THE_PAPER)
    return replace(
        project,
        source=replace(project.source, flatten=flatten),
        target=replace(project.target, flatten=flatten),
        boundary=replace(project.boundary, pairing="nearest"),
    )


def _with_handles(project: Project, role: Role, handles: HandleParameters) -> Project:
    return set_brain(project, role, replace(brain_of(project, role), handles=handles))


def _replace_pair(project: Project, identifier: str, **changes: object) -> Project:
    return replace(
        project,
        pairs=tuple(
            replace(pair, **changes) if pair.id == identifier else pair  # type: ignore[arg-type]
            for pair in project.pairs
        ),
    )
