"""Normals of faces, and of vertices: the mean of the faces around, the larger ones counting more."""

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


def face_normals(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the (m, 3) normals of faces, each as long as twice the face's area."""
    normals = np.zeros((len(faces), 3))
    _fill_faces(vertices, faces, normals)
    return normals


@njit(nogil=True, cache=True)
def _normal(
    vertices: NDArray[np.floating], face: NDArray[np.int64]
) -> tuple[np.floating, np.floating, np.floating]:
    a, b, c = face
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
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@njit(nogil=True, cache=True)
def _fill_faces(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], normals: NDArray[np.float64]
) -> None:
    for k in range(len(faces)):
        normals[k, 0], normals[k, 1], normals[k, 2] = _normal(vertices, faces[k])


@njit(nogil=True, cache=True)
def _add_faces(
    vertices: NDArray[np.floating], faces: NDArray[np.int64], normals: NDArray[np.floating]
) -> None:
    for face in faces:
        x, y, z = _normal(vertices, face)
        for corner in face:
            normals[corner, 0] += x
            normals[corner, 1] += y
            normals[corner, 2] += z
    for k in range(len(normals)):
        length = np.sqrt(normals[k, 0] ** 2 + normals[k, 1] ** 2 + normals[k, 2] ** 2)
        if length > 0:
            for axis in range(3):
                normals[k, axis] /= length
