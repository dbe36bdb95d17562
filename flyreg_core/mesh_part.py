"""Fewer vertices of a mesh, and fewer faces: what is drawn while a hand moves what is slow to draw."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np

from flyreg_core.mesh import Floats, Integers
from flyreg_core.normals import face_normals, vertex_normals


@dataclass(frozen=True, eq=False)
class MeshPart:
    """Some vertices of a mesh, with faces of their own."""

    rows: Integers  # (k,)
    faces: Integers  # (m, 3), their numbers among these vertices
    ring: Integers  # (r,) vertices of the faces around them
    ring_faces: Integers  # (f, 3), numbers in the ring
    places: Integers  # (k,) of the vertices in the ring

    @classmethod
    def of(cls, vertices: Floats, faces: Integers, boxes: int) -> MeshPart:
        """Return one vertex of each box that holds some, and the faces that are left with these.

        A box's vertex is the one nearest to its middle, or on a boundary the one farthest from it, so
        that corners stay. Faces that come to lie upside down hide nothing that others do not.
        """
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        inside = (vertices - low) / max(float((high - low).max()) / boxes, 1e-9)
        box = np.minimum(inside.astype(np.int64), boxes - 1)
        away = ((inside - box - 0.5) ** 2) @ np.ones(3)
        order = np.argsort(np.where(np.array(igl.is_border_vertex(faces)), -away, away))
        _, first, kept = np.unique(
            np.ravel_multi_index(tuple(box[order].T), (boxes,) * 3),
            return_index=True,
            return_inverse=True,
        )
        rows, own = order[first], np.zeros(len(vertices), dtype=np.int64)
        own[order] = kept
        fewer = own[faces]
        a, b, c = fewer.T
        fewer = fewer[(a != b) & (b != c) & (c != a)]
        is_kept = np.zeros(len(vertices), dtype=bool)
        is_kept[rows] = True
        a, b, c = is_kept[faces].T
        ring, ring_faces = np.unique(faces[a | b | c], return_inverse=True)
        ring_faces, places = ring_faces.reshape(-1, 3), np.searchsorted(ring, rows)
        normals = vertex_normals(vertices[ring], ring_faces)[places]
        along = face_normals(vertices[rows], fewer) * normals[fewer].sum(axis=1)
        return cls(rows, fewer[along.sum(axis=1) > 0], ring, ring_faces, places)
