"""Normals of vertices: the mean direction of the faces around, the larger ones counting more."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

Places = TypeVar("Places", NDArray[np.float64], NDArray[np.float32])


def vertex_normals(vertices: Places, faces: NDArray[np.int64]) -> Places:
    """Return the (n, 3) unit normals of vertices, in their precision; 0 where there is no face."""
    normals = np.zeros_like(vertices)
    _add_faces(vertices, faces, normals)
    return normals


@njit(nogil=True, cache=True)
def _add_faces(
    vertices: NDArray[np.floating], faces: NDArray[np.int64], normals: NDArray[np.floating]
) -> None:
    for a, b, c in faces:
        ux, uy, uz = (
            vertices[b, 0] - vertices[a, 0],
            vertices[b, 1] - vertices[a, 1],
            vertices[b, 2] - vertices[a, 2],
        )
        vx, vy, vz = (
            vertices[c, 0] - vertices[a, 0],
            vertices[c, 1] - vertices[a, 1],
            vertices[c, 2] - vertices[a, 2],
        )
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        for corner in (a, b, c):
            normals[corner, 0] += x
            normals[corner, 1] += y
            normals[corner, 2] += z
    for k in range(len(normals)):
        length = np.sqrt(normals[k, 0] ** 2 + normals[k, 1] ** 2 + normals[k, 2] ** 2)
        if length > 0:
            for axis in range(3):
                normals[k, axis] /= length
