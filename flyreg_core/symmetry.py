"""The plane that parts left from right: where a brain is most like its mirror image."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numba import njit

from flyreg_core.errors import InputError
from flyreg_core.mesh import Floats
from flyreg_core.occupancy import Occupancy
from flyreg_core.side_by_side import side_by_side

TILTS = np.deg2rad(12.0) * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1.0]])
SHIFTS = (0.0, -0.25, 0.25, -0.5, 0.5, -0.75, 0.75)
"""Planes tried about each principal axis: tilts in radians, shifts in root mean square widths."""
REFINED = 12
COARSE_ROUNDS, CHOICE_ROUNDS, FINE_ROUNDS = 8, 3, 20
CONVERGED = 1e-9
"""A round that turns and moves the plane by less than this, relative to the brain, is the last."""
LONGEST_STEP = 0.1
BLUR, BROADER_BLUR = 1.0, 2.5
"""Widths of the Gaussians whose difference shows the surface, cubes."""
WIDTH_WEIGHT = 0.15
"""How much a doubled width outweighs likeness, for shapes with several planes of symmetry."""
CLEARLY = 0.03
"""By how much the best plane must lead."""


@dataclass(frozen=True, eq=False)
class SymmetryPlane:
    """Points whose product with `normal` is `height` lie on it."""

    normal: Floats  # (3,), unit vector
    height: float  # micrometres
    likeness: float = 0.0  # correlation of the surface with its mirror image
    width: float = 0.0  # root mean square distance of the surface from the plane, micrometres

    def distance(self, points: Floats) -> Floats:
        """Return the (n,) signed distances of (n, 3) points, micrometres."""
        return np.asarray(points @ self.normal - self.height)

    def mirrored(self, points: Floats) -> Floats:
        """Return the mirror images of (n, 3) points."""
        return np.asarray(points - (2 * self.distance(points))[:, np.newaxis] * self.normal)


def find_symmetry_plane(occupancy: Occupancy) -> SymmetryPlane:
    """Return the plane in which a shape is most like its mirror image; if in several, the widest.

    What is compared is the surface, as a difference of two blurs of the inside: parts that have no
    counterpart, such as a single optic lobe, do not pull, since elsewhere the difference is 0.

    Raises
    ------
    InputError
        Two such planes are equally good, as in a ball.
    """
    coarse = _Outline(occupancy.halved())
    tried = side_by_side(coarse.judged, _starts(occupancy.halved()))
    outline = _Outline(occupancy)
    best_tried = _best_first(tried)[:REFINED]
    rough = side_by_side(lambda plane: coarse.refined(plane, COARSE_ROUNDS), best_tried)
    distinct = _distinct(rough, coarse.size)
    fine = side_by_side(lambda plane: outline.refined(plane, CHOICE_ROUNDS), distinct)
    best, *others = _best_first(fine)
    widest = max(plane.width for plane in fine)
    rivals = [plane for plane in others if abs(plane.normal @ best.normal) < 0.7]
    if any(_merit(best, widest) < _merit(plane, widest) + CLEARLY for plane in rivals):
        raise InputError(
            "the shape has no direction that is clearly its left and right: it is as wide, and as "
            "much like its mirror image, another way, so it does not look like a brain"
        )
    return outline.refined(best, FINE_ROUNDS)


def _merit(plane: SymmetryPlane, widest: float) -> float:
    return plane.likeness + WIDTH_WEIGHT * float(np.log2(plane.width / widest))


def _best_first(planes: list[SymmetryPlane]) -> list[SymmetryPlane]:
    widest = max(plane.width for plane in planes)
    return sorted(planes, key=lambda plane: -_merit(plane, widest))


def _distinct(planes: list[SymmetryPlane], size: float) -> list[SymmetryPlane]:
    """Return planes without those that are close to an earlier one; `size` is the brain's."""
    kept: list[SymmetryPlane] = []
    for plane in planes:
        side = [float(np.sign(plane.normal @ other.normal)) for other in kept]
        if all(
            abs(plane.normal @ other.normal) < 0.995
            or abs(plane.height - sign * other.height) > 0.03 * size
            for other, sign in zip(kept, side, strict=True)
        ):
            kept.append(plane)
    return kept


def _starts(occupancy: Occupancy) -> list[SymmetryPlane]:
    points, share = occupancy.filled()
    middle = share @ points / share.sum()
    widths = np.sqrt(share @ (points - middle) ** 2 / share.sum())
    planes = []
    for axis, tilt, shift in product(range(3), TILTS, SHIFTS):
        normal = np.insert(tilt, axis, 1.0)
        normal /= np.linalg.norm(normal)
        planes.append(SymmetryPlane(normal, float(middle @ normal + shift * widths[axis])))
    return planes


class _Outline:
    """A function on space that is large inside the surface, negative outside, 0 far away."""

    def __init__(self, occupancy: Occupancy) -> None:
        fine, broad = occupancy.blurred(BLUR, BROADER_BLUR), occupancy.blurred(BROADER_BLUR)
        outline = replace(fine, share=fine.share - broad.share)
        slopes = np.gradient(outline.share, outline.pitch)
        self.grid = outline
        self.fields = np.stack([outline.share, *slopes], axis=-1)
        high = np.abs(outline.share) > 0.02
        self.points = outline.low + outline.pitch * np.stack(np.nonzero(high), axis=-1)
        self.value = outline.share[high]
        self.size = float(np.abs(self.points).max())

    def judged(self, plane: SymmetryPlane) -> SymmetryPlane:
        """Return a plane with its likeness and width."""
        there = self._mirror_values(plane, self.fields[..., :1])[:, 0]
        square = self.value**2
        likeness = self.value @ there / square.sum()
        width = np.sqrt(np.average(plane.distance(self.points) ** 2, weights=square))
        return replace(plane, likeness=float(likeness), width=float(width))

    def refined(self, plane: SymmetryPlane, rounds: int) -> SymmetryPlane:
        """Return the plane near another one in which likeness is largest, by Gauss-Newton rounds."""
        for _ in range(rounds):
            step, across = self._step(plane)
            step /= max(1.0, float(np.abs(step).max()) / LONGEST_STEP)
            normal = plane.normal + step[:2] @ across
            height = plane.height + self.size * step[2]
            plane = SymmetryPlane(normal / np.linalg.norm(normal), float(height))
            if np.abs(step).max() < CONVERGED:
                break
        return self.judged(plane)

    def _mirror_values(self, plane: SymmetryPlane, fields: Floats) -> Floats:
        """Return the (n, f) values of (a, b, c, f) fields at the mirror images of the points."""
        places = (plane.mirrored(self.points) - self.grid.low) / self.grid.pitch
        return np.asarray(_interpolate(fields, places))

    def _step(self, plane: SymmetryPlane) -> tuple[Floats, Floats]:
        """Return two tilts and a shift, and the (2, 3) directions in which the normal tilts."""
        across = np.linalg.svd(plane.normal[np.newaxis])[2][1:]
        slope = self._mirror_values(plane, self.fields[..., 1:])
        distance, along_normal = plane.distance(self.points), slope @ plane.normal
        # how a mirrored point's value changes when the plane tilts and shifts
        tilts = [(self.points @ t) * along_normal + distance * (slope @ t) for t in across]
        jacobian = 2 * np.stack([-tilts[0], -tilts[1], self.size * along_normal], axis=1)
        system = jacobian.T @ jacobian
        system += 1e-9 * np.trace(system) * np.eye(3)  # a body of revolution leaves a tilt open
        return np.linalg.solve(system, jacobian.T @ self.value), across


@njit(cache=True, nogil=True)
def _interpolate(fields: Floats, places: Floats) -> Floats:
    """Return (n, f) values of (a, b, c, f) fields between the cubes around (n, 3) places, or 0."""
    values = np.zeros((len(places), fields.shape[3]))
    for row in range(len(places)):
        x, y, z = places[row]
        i, j, k = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
        is_within = i >= 0 and j >= 0 and k >= 0 and i + 1 < fields.shape[0]
        if not (is_within and j + 1 < fields.shape[1] and k + 1 < fields.shape[2]):
            continue
        for corner in range(8):
            a, b, c = corner >> 2, corner >> 1 & 1, corner & 1
            weight = abs((1 - a - (x - i)) * (1 - b - (y - j)) * (1 - c - (z - k)))
            for field in range(fields.shape[3]):
                values[row, field] += weight * fields[i + a, j + b, k + c, field]
    return values
