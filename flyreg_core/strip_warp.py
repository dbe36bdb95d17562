"""A half between rectangle and strip: where its spline takes it, and how its boundaries draw it along."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from flyreg_core.mesh import Floats, Integers
from flyreg_core.rectangle import from_plane


@dataclass(frozen=True, eq=False)
class Fading:
    """How each vertex of a half goes along with one boundary: between two of its vertices."""

    before: Integers  # (k,), places along the boundary
    after: Integers
    share: Floats  # (k,), 0 at the one before to 1 at the one after
    part: Floats  # (k,), 1 on the boundary to 0 on the other one


def find_fading(u: Floats, loop: Integers, part: Floats) -> Fading:
    """Return how (k,) vertices at u of the strip go along with the boundary `loop`."""
    around = np.mod(u[loop], 1.0)
    order = np.argsort(around, kind="stable")
    known = around[order]
    place = np.mod(u, 1.0)
    after = np.searchsorted(known, place, side="right")
    low, high = known[after - 1], known[after % len(loop)]
    low, high = low - (after == 0), high + (after == len(loop))
    share = np.divide(place - low, high - low, out=np.zeros_like(place), where=high > low)
    return Fading(order[after - 1], order[after % len(loop)], share, part)


def to_strip(places: Floats, u: Floats) -> tuple[Floats, Floats]:
    """Return by how much u of vertices grows if they go to (k, 2) places of the rectangle, and beta."""
    shift, beta = from_plane(places)
    _turn(shift, u)
    return shift, beta


def draw_along(
    u: Floats,
    shift: Floats,
    beta: Floats,
    fadings: tuple[Fading, Fading],
    misses: tuple[Floats, Floats],
) -> Floats:
    """Return (k, 2) u + shift and beta, moved as far as both boundaries draw vertices along.

    Parameters
    ----------
    misses : (b, 2) and (c, 2) float
        How far u and beta of the vertices of each boundary must still go.
    """
    moved = np.zeros((len(u), 2))
    moved[:, 0], moved[:, 1] = u + shift, beta
    for fading, miss in zip(fadings, misses, strict=True):
        _draw_along(moved, fading.before, fading.after, fading.share, fading.part, miss)
    return moved


@njit(nogil=True, cache=True)
def _draw_along(
    values: Floats,
    before: Integers,
    after: Integers,
    share: Floats,
    part: Floats,
    misses: Floats,
) -> None:
    for k in range(len(values)):
        one, other = before[k], after[k]
        for axis in range(2):
            low = misses[one, axis]
            values[k, axis] += part[k] * (low + share[k] * (misses[other, axis] - low))


@njit(nogil=True, cache=True)
def _turn(there: Floats, u: Floats) -> None:
    for k in range(len(u)):
        step = there[k] - u[k]
        there[k] = step - math.floor(step + 0.5)
