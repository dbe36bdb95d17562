"""Fewer vertices of a mesh, and fewer faces: what is drawn while a hand moves what is slow to draw."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np

from flyreg_core.mesh import Booleans, Floats, Integers
from flyreg_core.normals import face_normals, vertex_normals
from flyreg_core.topology import used_vertices


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

        Parameters
        ----------
        boxes : int
            Along the longest side of the mesh.

        Notes
        -----
        Faces that come to lie upside down are left out: they hide nothing that others do not.

        References
        ----------
        Rossignac and Borrel, Multi-resolution 3D approximations for rendering complex scenes, Modeling
        in Computer Graphics, 1993.
        """
        used = used_vertices(faces)
        if not len(used):
            return cls(used, faces, used, faces, used)
        is_border = np.array(igl.is_border_vertex(faces))[used]
        chosen, box = _one_of_each_box(vertices[used], is_border, boxes)
        rows, own = used[chosen], np.zeros(len(vertices), dtype=np.int64)
        own[used] = box
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


def _one_of_each_box(places: Floats, is_border: Booleans, boxes: int) -> tuple[Integers, Integers]:
    """Return which of (n, 3) places stands for each box, and the number of the box that each is in.

    It is the one nearest to the box's middle, or on a border the one farthest from it: so corners
    stay.
    """
    low, high = places.min(axis=0), places.max(axis=0)
    inside = (places - low) / max(float((high - low).max()) / boxes, 1e-9)
    cell = np.minimum(inside.astype(np.int64), boxes - 1)
    away = ((inside - cell - 0.5) ** 2) @ np.ones(3)
    order = np.argsort(np.where(is_border, -away, away))
    key = np.ravel_multi_index(tuple(cell[order].T), (boxes,) * 3)
    _, first, number = np.unique(key, return_index=True, return_inverse=True)
    box = np.zeros(len(places), dtype=np.int64)
    box[order] = number
    return order[first], box
