"""How much of each small cube of space a surface fills, in axes that turn with the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from flyreg_core.errors import InputError
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.winding_number import winding_numbers

CUBES = 30_000
"""Cubes in the box around a brain: some 8 to 15 um wide, fine enough for whatever lies lobe by lobe."""
EMPTY = 0.02
"""Cubes filled less than this count as empty."""


@dataclass(frozen=True, eq=False)
class OwnAxes:
    """The centroid and the principal axes of a surface, in the coordinates of its file."""

    origin: Floats  # (3,), micrometres
    axes: Floats  # (3, 3), rows are unit vectors, the widest direction first

    def coordinates(self, points: Floats) -> Floats:
        """Return (..., 3) points of the file in these axes, micrometres."""
        return np.asarray((points - self.origin) @ self.axes.T)

    def points(self, coordinates: Floats) -> Floats:
        """Return where (..., 3) coordinates in these axes lie in the file, micrometres."""
        return np.asarray(self.origin + coordinates @ self.axes)


@dataclass(frozen=True, eq=False)
class Occupancy:
    """What share of each cube of a grid is inside a surface."""

    share: Floats  # (a, b, c), 0 to 1
    low: Floats  # (3,), centre of the first cube, micrometres
    pitch: float  # edge of a cube, micrometres

    def filled(self) -> tuple[Floats, Floats]:
        """Return the (n, 3) centres of the cubes that are not empty, and their (n,) shares."""
        index = np.nonzero(self.share > EMPTY)
        return self.low + self.pitch * np.stack(index, axis=-1), self.share[index]

    def halved(self) -> Occupancy:
        """Return the same with cubes twice as wide."""
        a, b, c = (length // 2 for length in self.share.shape)
        share = self.share.reshape(a, 2, b, 2, c, 2).mean(axis=(1, 3, 5))
        return Occupancy(share, self.low + self.pitch / 2, 2 * self.pitch)

    def blurred(self, sigma: float, room_for: float = 0.0) -> Occupancy:
        """Return the same convolved with a Gaussian, `sigma` in cubes, on a grid as much wider.

        `room_for` makes the grid as wide as another, larger sigma needs.
        """
        margin = int(np.ceil(4 * max(sigma, room_for)))
        share = scipy.ndimage.gaussian_filter(np.pad(self.share, margin), sigma)
        return Occupancy(share, self.low - margin * self.pitch, self.pitch)


def find_own_axes(mesh: SurfaceMesh) -> OwnAxes:
    """Return the axes of inertia of a surface, each pointing where its third moment is positive.

    They depend on nothing but the shape: a mesh that is turned, moved, mirrored or scaled has axes
    that are turned, moved, mirrored or scaled with it. What is computed in them is therefore the
    same for all its copies, to rounding, whatever grids and trees along the axes are used.
    """
    corners = mesh.vertices[mesh.faces]
    area = mesh.face_areas / mesh.face_areas.sum()
    origin = area @ corners.mean(axis=1)
    offset = corners - origin
    middle = offset.mean(axis=1)
    moments = np.einsum("i,ikj,ikl->jl", area, offset, offset) / 12
    moments += 0.75 * np.einsum("i,ij,il->jl", area, middle, middle)
    axes = np.linalg.eigh(moments)[1][:, ::-1].T
    skewness = area @ (middle @ axes.T) ** 3
    return OwnAxes(origin, axes * np.where(skewness < 0, -1.0, 1.0)[:, np.newaxis])


def find_occupancy(mesh: SurfaceMesh, own: OwnAxes) -> Occupancy:
    """Return what lies inside a surface, in its own axes, whatever holes and sheets it has.

    The generalised winding number, cut to 0 to 1, says so without a threshold, so that it varies
    smoothly with the surface. The grid is its own mirror image in each axis.

    Raises
    ------
    InputError
        The surface encloses nothing.

    References
    ----------
    Barill, Dickson, Schmidt, Levin, Jacobson, Fast winding numbers for soups and clouds, ACM TOG
    37(4), 2018, doi:10.1145/3197517.3201337.
    """
    vertices = own.coordinates(mesh.vertices)
    half = np.abs(vertices).max(axis=0)
    pitch = float(np.cbrt(8 * half.prod() / CUBES))
    if pitch == 0:
        raise InputError("the surface is flat, so it has no front and no top")
    count = np.ceil(half / pitch).astype(int) + 1
    count += count % 2  # so that the cubes pair up on each side of the middle
    steps = (np.arange(2 * count[axis]) - count[axis] + 0.5 for axis in range(3))
    grid = pitch * np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1)
    winding_number = winding_numbers(grid.reshape(-1, 3), vertices, mesh.faces)
    share = np.clip(np.abs(winding_number), 0, 1).reshape(grid.shape[:3])
    if share.max() < 0.5:
        raise InputError("the surface encloses nothing, so it has no front and no top")
    return Occupancy(share, grid[0, 0, 0], pitch)
