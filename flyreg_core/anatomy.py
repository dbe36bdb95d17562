"""Where the parts of a fly's brain lie, and how a shape has to be turned so that they lie there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numba import njit

from flyreg_core.mesh import Floats

PARTS = (
    # share of the brain; mean; standard deviation, both lateral, ventral and posterior
    (0.17, (1.25, 0.03, -0.10), (0.45, 0.50, 0.34)),  # ventrolateral protocerebrum
    (0.14, (1.14, -1.08, 0.18), (0.44, 0.32, 0.34)),  # superior lateral protocerebrum, calyx
    (0.05, (0.27, -0.69, -0.06), (0.15, 0.53, 0.35)),  # superior medial protocerebrum
    (0.08, (0.54, -0.16, -0.61), (0.25, 0.60, 0.25)),  # antennal and mushroom body lobes
    (0.07, (0.74, 0.15, 0.54), (0.30, 0.57, 0.19)),  # posterior slope
    (0.10, (0.43, 1.11, 0.01), (0.25, 0.32, 0.42)),  # gnathal ganglia
    (0.17, (2.30, 0.22, 0.59), (0.51, 0.59, 0.26)),  # optic lobe: lobula and lobula plate
    (0.08, (2.56, 0.56, -0.06), (0.34, 0.54, 0.20)),  # optic lobe: anterior rim of the medulla
    (0.07, (3.24, 0.52, 0.48), (0.23, 0.52, 0.25)),  # optic lobe: lateral rim of the medulla
    (0.06, (2.52, 1.41, 0.28), (0.40, 0.28, 0.27)),  # optic lobe: ventral rim of the medulla
)
"""The right half of an adult fly's brain as a mixture of Gaussians.

Fitted by expectation maximisation to what is inside the surfaces of eight brains of three species,
each brought to the common mean by the parameters that `find_postures` fits. The unit is the root
mean square distance of the inside near the midline from its centre.
"""
ELSEWHERE = 1e-4
"""Density of what belongs to no part: nerves, debris."""
LIKELY_SD = np.array([0.88, 0.45])
"""Standard deviations of the inside near the midline, dorso-ventral and antero-posterior."""
HINGE = 1.6
"""Where the optic lobes begin; behind it they are swept up, down, forwards or back in each brain."""
SPREAD = np.array([1.5, 1.5, 1.0, 1.0, 1.0, 1.0, 1.0])
"""How far two shifts, three logarithms of scales and two slopes of the lobes stray; loose."""
ANGLES = 24
"""Turns about the left-right axis that are tried, for each sense of rotation."""
REFINED = 4
ROUNDS = 40


@dataclass(frozen=True, eq=False)
class Posture:
    """How a shape is turned, in the coordinates of its midplane."""

    ventral: Floats  # (2,), unit vector
    posterior: Floats  # (2,), unit vector perpendicular to it
    center: Floats  # (2,), where the middle of the mean brain lies
    log_likelihood: float  # mean over the inside, less the penalty of a strange form
    scale: Floats  # (3,), what makes it as wide, high and deep as the mean brain, up to a factor


def find_postures(lateral: Floats, midplane: Floats, share: Floats) -> tuple[Posture, ...]:
    """Return how a brain may be turned about its left-right axis, the likeliest first.

    Parameters
    ----------
    lateral : (n,) float
        Distances of points of the inside from the midplane, in any unit.
    midplane : (n, 2) float
        Their other two coordinates, along any two perpendicular directions.
    share : (n,) float
        How much of the inside each point stands for.

    Notes
    -----
    The likelihood of the points under `PARTS` is maximised over the angle, the sense of rotation,
    two shifts, three scales and the sweep of the optic lobes. Scales are free because a brain under
    a cover slip is a third as deep as high, and others four fifths; the sweep because optic lobes
    give way to whatever they are embedded in.
    """
    center, unit = find_middle(lateral, midplane, share)
    plane, weight = (midplane - center) / unit, share / share.sum()
    starts = []
    for sense in (1.0, -1.0):
        points = np.column_stack([lateral / unit, plane * [1.0, sense]])
        tried = [_start(turn * 2 * np.pi / ANGLES, points, weight) for turn in range(ANGLES)]
        cost = np.array([_cost(start, points, weight)[0] for start in tried])
        lowest = (cost <= np.roll(cost, 1)) & (cost <= np.roll(cost, -1))
        starts += [(cost[i], sense, tried[i]) for i in np.flatnonzero(lowest)]
    postures = []
    for _, sense, start in sorted(starts, key=lambda start: float(start[0]))[:REFINED]:
        points = np.column_stack([lateral / unit, plane * [1.0, sense]])
        found = scipy.optimize.minimize(
            _cost, start, (points, weight), "BFGS", jac=True, options={"maxiter": ROUNDS}
        )
        turn = _rotation(found.x[0])[1:, 1:] * [1.0, sense]
        middle = center - unit * found.x[1:3] @ turn
        scale = np.exp(found.x[3:6])
        postures.append(Posture(turn[0], turn[1], middle, -float(found.fun), scale))
    return tuple(sorted(postures, key=lambda posture: -posture.log_likelihood))


def find_middle(lateral: Floats, midplane: Floats, share: Floats) -> tuple[Floats, float]:
    """Return the (2,) centre of the inside near the midline and its root mean square distance."""
    weight = share
    for _ in range(20):  # what is near depends on the distance; it settles within a few rounds
        center = np.average(midplane, axis=0, weights=weight)
        square = ((midplane - center) ** 2).sum(axis=1)
        unit = float(np.sqrt(np.average(square, weights=weight)))
        weight = share * np.exp(-0.5 * (lateral / unit) ** 2)
    return center, unit


def _start(angle: float, points: Floats, weight: Floats) -> Floats:
    """Return (8,) parameters: an angle, no shift, scales that give likely extents, no sweep."""
    near = weight * np.exp(-0.5 * points[:, 0] ** 2)
    turned = points @ _rotation(angle).T
    extent = np.sqrt(np.average(turned[:, 1:] ** 2, axis=0, weights=near))
    scale = np.clip(np.log(LIKELY_SD / extent), -0.45, 0.45)
    return np.array([angle, 0.0, 0.0, 0.0, *scale, 0.0, 0.0])


def _rotation(angle: float) -> Floats:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, cosine, sine], [0, -sine, cosine]])


def _cost(parameters: Floats, points: Floats, weight: Floats) -> tuple[float, Floats]:
    """Return the negative log posterior of (8,) parameters and its slope."""
    shift, scale, sweep = parameters[1:3], np.exp(parameters[3:6]), parameters[6:]
    outward = np.maximum(points[:, 0] - HINGE, 0)
    moved = shift + outward[:, np.newaxis] * sweep
    rotated = points @ _rotation(parameters[0]).T
    formed = (rotated + np.column_stack([np.zeros(len(points)), moved])) * scale
    density, pull = _mixture(formed)
    stray = parameters[1:] / SPREAD
    value = -weight @ np.log(density) - parameters[3:6].sum() + 0.5 * stray @ stray
    pull *= weight[:, np.newaxis]
    in_plane = pull[:, 1:] * scale[1:]
    slope = np.zeros(8)
    slope[0] = in_plane[:, 0] @ rotated[:, 2] - in_plane[:, 1] @ rotated[:, 1]
    slope[1:3] = in_plane.sum(axis=0)
    slope[3:6] = (pull * formed).sum(axis=0) - 1
    slope[6:] = outward @ in_plane
    slope[1:] += stray / SPREAD
    return float(value), slope


def _mixture(points: Floats) -> tuple[Floats, Floats]:
    """Return the (n,) density of `PARTS` at points and the (n, 3) slope of its negative logarithm."""
    heights = [share / (np.prod(deviation) * (2 * np.pi) ** 1.5) for share, _, deviation in PARTS]
    means = np.array([mean for _, mean, _ in PARTS])
    deviations = np.array([deviation for _, _, deviation in PARTS])
    return _density_and_pull(np.ascontiguousarray(points), np.array(heights), means, deviations)


@njit(nogil=True, cache=True)
def _density_and_pull(
    points: Floats, heights: Floats, means: Floats, deviations: Floats
) -> tuple[Floats, Floats]:
    """Return the density of Gaussians, and of nothing but `ELSEWHERE`, and its logarithm's slope."""
    density, pull = np.full(len(points), ELSEWHERE), np.zeros_like(points)
    offset = np.zeros(3)
    for k in range(len(points)):
        for part in range(len(heights)):
            for i in range(3):
                offset[i] = (points[k, i] - means[part, i]) / deviations[part, i]
            square = offset[0] ** 2 + offset[1] ** 2 + offset[2] ** 2
            here = heights[part] * np.exp(-0.5 * square)
            density[k] += here
            for i in range(3):
                pull[k, i] += here * offset[i] / deviations[part, i]
        for i in range(3):
            pull[k, i] /= density[k]
    return density, pull
