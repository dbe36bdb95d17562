"""The flat domain as the paper draws it: a rectangle with a hole, its picture of the strip.

A point of the strip is (u, v): u runs once clockwise around the rectangle from its upper left
corner, in shares of the perimeter; v runs from 0 on the hole to 1 on the outside. The hole is the
rectangle made smaller, so rays from the centre are lines of constant u and the picture is
one-to-one whatever the half looks like.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numba import njit

from flyreg_core.landmarks import CurveName, HalfName
from flyreg_core.mesh import Floats

WIDTH, HEIGHT = 3.0, 2.0
PERIMETER = 2 * (WIDTH + HEIGHT)
HOLE = 0.25
"""Size of the hole, as a share of the rectangle's."""
TOP = WIDTH / 2 / PERIMETER
"""u of the middle of the upper side."""
STARTS: dict[CurveName, tuple[float, float]] = {
    "upper": (0.0, WIDTH / PERIMETER),
    "left": (WIDTH / PERIMETER, HEIGHT / PERIMETER),
    "lower": ((2 * WIDTH + HEIGHT) / PERIMETER, -WIDTH / PERIMETER),
    "right": (1.0, -HEIGHT / PERIMETER),
    "hole": (TOP, 1.0),
}
"""Where each curve starts and how far it runs, seen from the front, in shares of the perimeter."""


@dataclass(frozen=True)
class RadialLaw:
    """How v becomes the distance from the hole, so that half of a half's area has half the room.

    beta = (exp(rate v) - 1) / (exp(rate) - 1) runs from 0 on the hole to 1 on the outside. Without
    it the inside of the oesophagus, a long narrow tube, would take most of the rectangle.
    """

    rate: float

    def beta(self, v: Floats) -> Floats:
        """Return the share of the way from the hole to the outside."""
        if abs(self.rate) < 1e-9:
            return np.asarray(v, dtype=float)
        return np.asarray(np.expm1(self.rate * v) / np.expm1(self.rate))

    def v(self, beta: Floats) -> Floats:
        """Return the inverse of `beta`."""
        if abs(self.rate) < 1e-9:
            return np.asarray(beta, dtype=float)
        return np.asarray(np.log1p(beta * np.expm1(self.rate)) / self.rate)


def radial_law(v: Floats, area: Floats) -> RadialLaw:
    """Return the law for a half whose vertices lie at v and stand for the given areas."""
    order = np.argsort(v, kind="stable")
    cumulative = np.cumsum(area[order])
    median = float(np.interp(cumulative[-1] / 2, cumulative, v[order]))
    median = min(max(median, 0.02), 0.98)
    half_area = (np.sqrt((1 + HOLE**2) / 2) - HOLE) / (1 - HOLE)
    rate = scipy.optimize.brentq(
        lambda r: float(RadialLaw(r).beta(np.array(median))) - half_area, -200.0, 200.0
    )
    return RadialLaw(float(rate))


def perimeter_share(curve: CurveName, share: Floats) -> Floats:
    """Return where points at shares of the arc length of a curve lie, seen from the front."""
    start, run = STARTS[curve]
    return np.asarray(start + run * share)


def u_of_perimeter(half: HalfName, share: Floats) -> Floats:
    """Return u on a half; the posterior half is seen from behind, so left and right change sides."""
    return np.asarray(share if half == "anterior" else WIDTH / PERIMETER - share)


def perimeter_of_u(half: HalfName, u: Floats) -> Floats:
    """Return the inverse of `u_of_perimeter`, which is its own."""
    return u_of_perimeter(half, u)


def wrapped(difference: Floats) -> Floats:
    """Return differences of u reduced by whole turns to between -1/2 and 1/2."""
    return np.asarray(difference - np.round(difference))


def to_plane(u: Floats, beta: Floats) -> Floats:
    """Return the (k, 2) places in the rectangle, centred at 0, y up."""
    u, beta = np.broadcast_arrays(np.asarray(u, dtype=float), beta)
    places = _to_plane(np.ravel(u), np.ravel(beta).astype(float))
    return places.reshape(*u.shape, 2)


def from_plane(points: Floats) -> tuple[Floats, Floats]:
    """Return u in [0, 1) and beta of (k, 2) places, also outside the rectangle or in the hole."""
    u, beta = _from_plane(np.ascontiguousarray(points, dtype=float).reshape(-1, 2))
    shape = np.shape(points)[:-1]
    return u.reshape(shape), beta.reshape(shape)


@njit(nogil=True, cache=True)
def _to_plane(u: Floats, beta: Floats) -> Floats:
    places = np.zeros((len(u), 2))
    for k in range(len(u)):
        along = (u[k] % 1.0) * PERIMETER
        x, y = -WIDTH / 2, along - 2 * WIDTH - HEIGHT - HEIGHT / 2
        if along < WIDTH:
            x, y = along - WIDTH / 2, HEIGHT / 2
        elif along < WIDTH + HEIGHT:
            x, y = WIDTH / 2, WIDTH + HEIGHT / 2 - along
        elif along < 2 * WIDTH + HEIGHT:
            x, y = WIDTH + HEIGHT + WIDTH / 2 - along, -HEIGHT / 2
        size = HOLE + (1 - HOLE) * beta[k]
        places[k, 0], places[k, 1] = x * size, y * size
    return places


@njit(nogil=True, cache=True)
def _from_plane(points: Floats) -> tuple[Floats, Floats]:
    u, beta = np.zeros(len(points)), np.zeros(len(points))
    for k in range(len(points)):
        x, y = points[k, 0] / (WIDTH / 2), points[k, 1] / (HEIGHT / 2)
        size = max(abs(x), abs(y), 1e-12)
        x, y = x / size, y / size
        along = 2 * WIDTH + HEIGHT + (y + 1) * HEIGHT / 2
        if y >= 1 and x < 1:
            along = (x + 1) * WIDTH / 2
        elif x >= 1 and y > -1:
            along = WIDTH + (1 - y) * HEIGHT / 2
        elif y <= -1 and x > -1:
            along = WIDTH + HEIGHT + (1 - x) * WIDTH / 2
        u[k], beta[k] = (along / PERIMETER) % 1.0, (size - HOLE) / (1 - HOLE)
    return u, beta
