"""Stage 2c: the handles of a solid, which of them is the oesophagus, and a solid with that one only."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from flyreg_core.carve import (
    NEIGHBOURS,
    Membrane,
    carve,
    find_membranes,
    link_of,
    pieces_of_outside,
    steps_through,
)
from flyreg_core.errors import TopologyError
from flyreg_core.frame import ANTERO_POSTERIOR, DORSO_VENTRAL, LEFT_RIGHT
from flyreg_core.mesh import Booleans, Floats, Integers
from flyreg_core.progress import Report, within
from flyreg_core.solid import VoxelSolid, kuhn_structure

Point = tuple[float, float, float]
Voxel = tuple[int, int, int]

MIDLINE_SHARE = 0.1
"""How far from the midplane the oesophagus may lie, as a share of the main brain's width."""
CENTRAL = (0.3, 0.75)
"""Where the oesophagus may lie between the dorsal and the ventral end of the midline."""
LEAST_ALONG = 0.3
"""Least share of its direction that the oesophagus has along the antero-posterior axis."""
LEAST_CLEAR = 0.33
"""How much thinner than elsewhere on the midline the brain is at least along the oesophagus."""
CLEAR = 0.5
"""How much thinner it must be there for no doubt to remain."""
SIMILAR = 0.6
"""Another candidate whose width and clearness come to this share of the best makes it a guess."""
THINNEST = 0.6
"""A channel is drilled unasked where the midline is at most this share as thick as elsewhere."""
SIGHT = 2
"""How far around a handle the brain may be thin, voxels."""
DRILL_RADIUS = 1.5
"""Radius of a drilled channel, voxels."""
SURROUNDINGS = 6
"""How far around a membrane its two sides are told apart, voxels."""
DRILL_BEYOND = 3.0
"""How far a drilled channel goes on beyond the two points, voxels."""


@dataclass(frozen=True)
class HandleParameters:
    """What the user said about the tunnels; places in the file's frame, micrometres."""

    hole: Point | None = None  # the oesophagus is the tunnel nearest to this; None chooses
    closed: tuple[Point, ...] = ()  # the tunnels nearest to these are not the oesophagus
    drills: tuple[tuple[Point, Point], ...] = ()  # channels from one point straight to another

    @property
    def is_decided(self) -> bool:
        """Tell whether the user said which tunnel is the oesophagus."""
        return self.hole is not None or bool(self.drills)


@dataclass(frozen=True)
class Handle:
    """A tunnel through the solid, closed by a membrane at its narrowest place."""

    center_um: Point
    width_um: float
    direction: Point  # along which it runs, pointing posteriorly
    is_near_midline: bool
    clearness: float  # how much thinner the brain is there than elsewhere on the midline, 0 to 1
    is_candidate: bool  # central, on the midline, clear, and running from front to back
    is_oesophagus: bool


@dataclass(frozen=True, eq=False)
class Carving:
    """A solid with one handle, and what it took to get there."""

    solid: VoxelSolid
    handles: tuple[Handle, ...]  # widest first, exactly one of them the oesophagus
    chosen_by: str  # why this one is taken for the oesophagus
    is_guess: bool
    membrane: Booleans  # the voxels that closed the oesophagus
    behind: Booleans  # the voxels outside next to the membrane's posterior side


def drill(solid: VoxelSolid, parameters: HandleParameters) -> VoxelSolid:
    """Return the solid without the channels that the user drilled."""
    inside = solid.inside.copy()
    for start, end in parameters.drills:
        ends = solid.frame.coordinates(np.array([start, end]))
        along = (ends[1] - ends[0]) / max(float(np.linalg.norm(ends[1] - ends[0])), 1e-9)
        first = ends[0] - DRILL_BEYOND * solid.pitch * along
        last = ends[1] + DRILL_BEYOND * solid.pitch * along
        index = np.argwhere(inside)
        arm = solid.origin + solid.pitch * index - first
        progress = np.clip(arm @ along, 0, float((last - first) @ along))
        away = np.linalg.norm(arm - progress[:, None] * along, axis=1)
        inside[tuple(index[away <= DRILL_RADIUS * solid.pitch].T)] = False
    return replace(solid, inside=inside)


def open_oesophagus(solid: VoxelSolid, parameters: HandleParameters, report: Report) -> Carving:
    """Return the smallest solid around the given one that has exactly one handle, the oesophagus.

    Parameters
    ----------
    solid : VoxelSolid
        One component without cavities.

    Raises
    ------
    TopologyError
        No tunnel can be the oesophagus.

    Notes
    -----
    Only adds voxels, thin membranes across the other tunnels. A block around the solid is carved
    down to it; as that keeps the topology of a ball, a membrane remains in each tunnel. Piercing
    the one in the oesophagus opens that tunnel and no other.
    """
    low, box = _box_around(solid.inside)
    fixed = solid.inside[box]
    distance = scipy.ndimage.distance_transform_edt(~fixed)
    inside = np.zeros_like(fixed)
    inside[1:-1, 1:-1, 1:-1] = True
    carve(inside, fixed, distance, within(report, 0.0, 0.8))
    cropped = replace(solid, inside=fixed, origin=solid.origin + solid.pitch * low)
    membranes = find_membranes(inside, fixed, distance)
    midline, openness = _Midline.of(cropped), _Openness.of(inside)
    found = [_handle(membrane, cropped, midline, openness) for membrane in membranes]
    chosen, chosen_by, is_guess = _choose(found, parameters)
    sides = openness.sides(membranes[chosen].voxel)
    before = inside.copy()
    inside[membranes[chosen].voxel] = False
    carve(inside, fixed, distance, within(report, 0.8, 1.0))
    sheet = before & ~inside
    behind = _behind(before, sheet, *sides)
    handles = tuple(
        replace(handle, is_oesophagus=number == chosen) for number, handle in enumerate(found)
    )
    carved, membrane, posterior = (np.zeros_like(solid.inside) for _ in range(3))
    carved[box], membrane[box], posterior[box] = inside, sheet, behind
    return Carving(replace(solid, inside=carved), handles, chosen_by, is_guess, membrane, posterior)


def _box_around(inside: Booleans) -> tuple[Integers, tuple[slice, ...]]:
    occupied = [np.flatnonzero(inside.any(axis=others)) for others in ((1, 2), (0, 2), (0, 1))]
    low = np.array([line[0] for line in occupied]) - 2
    high = np.array([line[-1] for line in occupied]) + 3
    return low, tuple(slice(a, b) for a, b in zip(low, high, strict=True))


@dataclass(frozen=True, eq=False)
class _Midline:
    """How thick the main brain is from front to back, seen from the front."""

    thickness: Floats  # (nx, ny), micrometres
    usual: float  # median on the midline
    ends: tuple[float, float]  # dorsal and ventral end of the midline, micrometres
    width: float  # of the main brain

    @classmethod
    def of(cls, solid: VoxelSolid) -> _Midline:
        thickness = solid.pitch * solid.inside.sum(axis=ANTERO_POSTERIOR)
        x, y = solid.coordinates(LEFT_RIGHT), solid.coordinates(DORSO_VENTRAL)
        occupied = x[thickness.any(axis=1)]
        width = float(occupied[-1] - occupied[0])
        strip = thickness[np.abs(x) <= MIDLINE_SHARE / 2 * width]
        rows = np.flatnonzero(strip.any(axis=0))
        if not len(rows):
            raise TopologyError(
                "the main brain does not reach the plane of its symmetry, so its oesophagus cannot "
                "be told; check that the file holds a whole brain"
            )
        usual = float(np.median(strip[:, rows]))
        return cls(thickness, usual, (float(y[rows[0]]), float(y[rows[-1]])), width)

    def is_near(self, x: Floats) -> Booleans:
        """Tell which places lie near the midplane."""
        return np.asarray(np.abs(x) <= MIDLINE_SHARE * self.width)

    def is_central(self, y: Floats) -> Booleans:
        """Tell which places lie well between the dorsal and the ventral end."""
        share = (y - self.ends[0]) / max(self.ends[1] - self.ends[0], 1e-9)
        return np.asarray((share >= CENTRAL[0]) & (share <= CENTRAL[1]))

    def clearness(self, thickness: float) -> float:
        """Return how much thinner a place is than usual, 0 to 1."""
        return float(np.clip(1 - thickness / max(self.usual, 1e-9), 0, 1))


def find_thinnest_channel(solid: VoxelSolid) -> tuple[Point, Point] | None:
    """Return the ends of a channel through the thinnest place of the midline, if it is thin there."""
    midline = _Midline.of(solid)
    x, y = solid.coordinates(LEFT_RIGHT), solid.coordinates(DORSO_VENTRAL)
    thickness = scipy.ndimage.gaussian_filter(midline.thickness, 1.0)
    is_eligible = midline.is_near(2 * x)[:, None] & midline.is_central(y)[None]
    if not is_eligible.any():
        return None
    i, j = np.unravel_index(int(np.where(is_eligible, thickness, np.inf).argmin()), thickness.shape)
    column = np.flatnonzero(solid.inside[i, j])
    if thickness[i, j] > THINNEST * midline.usual or not len(column):
        return None
    front, back = (
        as_point(solid.positions(tuple(np.array([i, j, k])))) for k in (column[0], column[-1])
    )
    return front, back


@dataclass(frozen=True, eq=False)
class _Openness:
    """How far it is through the outside to the front and to the back of the brain."""

    closed: Booleans  # (nx, ny, nz), the solid with all tunnels closed by membranes
    to_front: Integers  # (nx, ny, nz), steps from before the brain
    to_back: Integers

    @classmethod
    def of(cls, closed: Booleans) -> _Openness:
        ends = [np.zeros_like(closed) for _ in range(2)]
        ends[0][:, :, 1], ends[1][:, :, -2] = True, True
        return cls(closed, *(steps_through(~closed, end) for end in ends))

    def sides(self, voxel: Voxel) -> tuple[Voxel, Voxel]:
        """Return a voxel outside on either side of a membrane, the one nearer to the front first."""
        pieces = [
            np.array(voxel) + NEIGHBOURS[sorted(piece)]
            for piece in pieces_of_outside(link_of(self.closed, voxel))
        ]
        one, other = (tuple(int(i) for i in piece[0]) for piece in pieces)
        lead = [self.to_front[place] - self.to_back[place] for place in (one, other)]
        return (one, other) if lead[0] <= lead[1] else (other, one)  # type: ignore[return-value]

    def runs_from_front_to_back(self, voxel: Voxel) -> bool:
        """Tell whether one side of a membrane is nearer to the front, the other to the back."""
        front, back = self.sides(voxel)
        return bool(
            self.to_front[front] < self.to_back[front] and self.to_back[back] < self.to_front[back]
        )


def _handle(
    membrane: Membrane, solid: VoxelSolid, midline: _Midline, openness: _Openness
) -> Handle:
    place = solid.positions(tuple(np.array(membrane.voxel)))
    direction = membrane.direction * np.sign(membrane.direction[ANTERO_POSTERIOR] or 1.0)
    x, y, _ = solid.frame.coordinates(place)
    around = tuple(slice(max(0, v - SIGHT), v + SIGHT + 1) for v in membrane.voxel[:2])
    clearness = midline.clearness(float(midline.thickness[around].min()))
    is_near = bool(midline.is_near(x))
    is_candidate = (
        is_near
        and bool(midline.is_central(y))
        and bool(direction[ANTERO_POSTERIOR] >= LEAST_ALONG)
        and openness.runs_from_front_to_back(membrane.voxel)
        and clearness >= LEAST_CLEAR
    )
    return Handle(
        as_point(place),
        membrane.width * solid.pitch,
        as_point(direction @ solid.frame.axes),
        is_near,
        clearness,
        is_candidate,
        is_oesophagus=False,
    )


def as_point(point: Floats) -> Point:
    """Return three coordinates as plain numbers."""
    return float(point[0]), float(point[1]), float(point[2])


def _choose(handles: list[Handle], parameters: HandleParameters) -> tuple[int, str, bool]:
    """Return the number of the oesophagus, why it is taken for it, and whether that is a guess."""
    if not handles:
        raise TopologyError(
            "the main brain has no tunnel, so there is no oesophagus; drill a channel for it from "
            "the front to the back, or check the trim planes and the resolution"
        )
    centers = np.array([handle.center_um for handle in handles])
    if parameters.hole is not None:
        away = np.linalg.norm(centers - parameters.hole, axis=1)
        return int(away.argmin()), "pointed at by the user", False
    shut = {int(np.linalg.norm(centers - p, axis=1).argmin()) for p in parameters.closed}
    rest = [number for number in range(len(handles)) if number not in shut]
    if parameters.drills and rest:
        away = np.linalg.norm(centers[:, None] - _along(parameters.drills), axis=2).min(axis=1)
        nearest = min(rest, key=lambda number: float(away[number]))
        return nearest, "drilled by the user", False
    merit = {n: handles[n].width_um * handles[n].clearness for n in rest if handles[n].is_candidate}
    if not merit:
        raise TopologyError(
            f"none of the {len(handles)} tunnels through the main brain is central, near its midline "
            "and clear from front to back, so the oesophagus cannot be told; point at one of them, "
            "or drill a channel from the front to the back"
        )
    best, *others = sorted(merit, key=lambda number: (-merit[number], number))
    is_guess = handles[best].clearness < CLEAR or any(
        merit[other] >= SIMILAR * merit[best] for other in others
    )
    return best, "widest clear tunnel near the middle of the midline", is_guess


def _along(drills: tuple[tuple[Point, Point], ...]) -> Floats:
    """Return (k, 3) points along the drilled channels."""
    share = np.linspace(0, 1, 21)[:, None]
    return np.concatenate(
        [(1 - share) * np.array(start) + share * np.array(end) for start, end in drills]
    )


def _behind(before: Booleans, sheet: Booleans, front: Voxel, back: Voxel) -> Booleans:
    """Return the voxels outside that touch a sheet from behind.

    The sheet parts its surroundings; each voxel next to it belongs to the side from which it is
    reached sooner without crossing the sheet.
    """
    occupied = np.argwhere(sheet)
    low = np.maximum(occupied.min(axis=0) - SURROUNDINGS, 0)
    box = tuple(slice(a, b) for a, b in zip(low, occupied.max(axis=0) + SURROUNDINGS, strict=True))
    structure, outside = kuhn_structure(), ~before[box]
    near = scipy.ndimage.binary_dilation(sheet[box], structure) & outside
    reached = np.zeros(outside.shape, dtype=np.int8)
    for number, seed in enumerate((front, back), start=1):
        reached[tuple(np.array(seed) - low)] = number
    news = reached > 0
    while news.any() and (near & (reached == 0)).any():
        grown = [scipy.ndimage.binary_dilation(reached == side, structure) for side in (1, 2)]
        news = outside & (reached == 0) & (grown[0] | grown[1])
        reached[news] = np.where(grown[0][news], 1, 2)
    behind = np.zeros_like(before)
    behind[box] = near & (reached == 2)
    return behind
