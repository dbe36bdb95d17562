"""How far a surface leaves the chords of edges that are laid flat on it, and where most."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from flyreg_core.locate import TriangleGrid, find_triangles, once_around
from flyreg_core.mesh import Floats, Integers
from flyreg_core.refine import CLOSEST_TO_END

ALONG = 0.3
"""What the surface is off along itself counts so much, against 1 across it."""
MOST_CROSSINGS = 200
"""An edge is followed over so many faces at most; what lies beyond is not looked at."""
LEAST_HEIGHT = 1e-12
"""Edges along the straight sides of a strip are followed as if they lay so far within it."""


@dataclass(frozen=True, eq=False)
class Ground:
    """A piece of a surface, laid flat: what lifts flat places to it."""

    grid: TriangleGrid
    is_strip: bool
    corners: Floats  # (m, 3, 3), of its faces, micrometres
    normals: Floats  # (m, 3), unit

    def lift(self, places: Floats) -> Floats:
        """Return the (k, 3) points at (k, 2) flat places."""
        face, barycentric = self.find(places)
        return np.asarray(np.einsum("ij,ijk->ik", barycentric, self.corners[face]))

    def find(self, places: Floats) -> tuple[Integers, Floats]:
        """Return the faces at (k, 2) flat places, and the (k, 3) barycentric coordinates there."""
        return find_triangles(self.grid, once_around(places) if self.is_strip else places)


@dataclass(frozen=True, eq=False)
class ChordalDeviation:
    """How the surface runs below edges, against the chords of their lifted ends."""

    area: Floats  # (k,), between each chord and what it spans, square micrometres
    most: Floats  # (k,), where the surface is farthest off, micrometres
    share: Floats  # (k,), how far along the edge that is
    points: Floats  # (k, 3), on the surface there


def chordal_deviations(
    ground: Ground, starts: Floats, steps: Floats, lifted: Floats
) -> ChordalDeviation:
    """Return how far a surface leaves the chords of edges.

    A surface of faces is a chain of straight lines along an edge, with corners where that
    crosses the edges of the surface: its deviation is known where it is known there.

    Parameters
    ----------
    starts, steps : (k, 2) float
        Where each edge starts, laid flat, and how far it goes.
    lifted : (k, 2, 3) float
        Both ends of each edge on the surface.
    """
    ends = starts + steps
    if ground.is_strip:
        height = np.clip(np.stack([starts, ends])[..., 1], LEAST_HEIGHT, 1 - LEAST_HEIGHT)
        starts = np.stack([starts[:, 0], height[0]], axis=1)
        ends = np.stack([ends[:, 0], height[1]], axis=1)
    face, _ = ground.find(starts)
    grid = ground.grid
    return ChordalDeviation(
        *_follow(
            *(starts, ends, lifted, face),
            *(grid.corners, grid.neighbours, ground.corners, ground.normals),
        )
    )


@njit(nogil=True, cache=True)
def _follow(
    starts: Floats,
    ends: Floats,
    lifted: Floats,
    faces: Integers,
    flat: Floats,
    neighbours: Integers,
    corners: Floats,
    normals: Floats,
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the columns of `ChordalDeviation`, from the face in which each edge starts.

    One loop without helpers, as `locate._walk` is. Faces run anticlockwise, so an edge leaves each
    through the side that starts on its right and ends on its left.
    """
    n = len(starts)
    area, most = np.zeros(n), np.zeros(n)
    share, points = np.full(n, 0.5), np.zeros((n, 3))
    for k in range(n):
        du, dv = ends[k, 0] - starts[k, 0], ends[k, 1] - starts[k, 1]
        squared = du * du + dv * dv
        if squared == 0:
            continue
        ax, ay, az = lifted[k, 0, 0], lifted[k, 0, 1], lifted[k, 0, 2]
        bx, by, bz = lifted[k, 1, 0] - ax, lifted[k, 1, 1] - ay, lifted[k, 1, 2] - az
        t, done, last = faces[k], 0.0, 0.0
        for _ in range(MOST_CROSSINGS):
            if t < 0:
                break
            # the copy of the face that lies here, on a strip that closes
            middle = (flat[t, 0, 0] + flat[t, 1, 0] + flat[t, 2, 0]) / 3
            here = starts[k, 0] + done * du
            u, v = starts[k, 0] + math.floor(middle - here + 0.5), starts[k, 1]
            side0 = du * (flat[t, 0, 1] - v) - dv * (flat[t, 0, 0] - u)
            side1 = du * (flat[t, 1, 1] - v) - dv * (flat[t, 1, 0] - u)
            side2 = du * (flat[t, 2, 1] - v) - dv * (flat[t, 2, 0] - u)
            if side0 < 0 <= side1:
                i, j, part = 0, 1, side0 / (side0 - side1)
            elif side1 < 0 <= side2:
                i, j, part = 1, 2, side1 / (side1 - side2)
            elif side2 < 0 <= side0:
                i, j, part = 2, 0, side2 / (side2 - side0)
            else:
                break
            x = flat[t, i, 0] + part * (flat[t, j, 0] - flat[t, i, 0]) - u
            y = flat[t, i, 1] + part * (flat[t, j, 1] - flat[t, i, 1]) - v
            along_edge = (x * du + y * dv) / squared
            if along_edge >= 1:
                break
            along_edge = max(along_edge, done)
            px = corners[t, i, 0] + part * (corners[t, j, 0] - corners[t, i, 0])
            py = corners[t, i, 1] + part * (corners[t, j, 1] - corners[t, i, 1])
            pz = corners[t, i, 2] + part * (corners[t, j, 2] - corners[t, i, 2])
            ox, oy, oz = (
                px - ax - along_edge * bx,
                py - ay - along_edge * by,
                pz - az - along_edge * bz,
            )
            across = abs(ox * normals[t, 0] + oy * normals[t, 1] + oz * normals[t, 2])
            along = math.sqrt(max(ox * ox + oy * oy + oz * oz - across * across, 0.0))
            off = across + ALONG * along
            area[k] += (along_edge - done) * (last + off) / 2
            if off > most[k] and CLOSEST_TO_END <= along_edge <= 1 - CLOSEST_TO_END:
                most[k], share[k] = off, along_edge
                points[k, 0], points[k, 1], points[k, 2] = px, py, pz
            done, last = along_edge, off
            t = neighbours[t, 3 - i - j]
        area[k] += (1 - done) * last / 2
        area[k] *= math.sqrt(bx * bx + by * by + bz * bz)
    return area, most, share, points
