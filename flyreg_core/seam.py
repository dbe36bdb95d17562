"""How the two lifted halves meet: the angle across their seam, and where the curve of the hole lies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.spatial import KDTree

from flyreg_core.boundary import nearest_on_chain
from flyreg_core.correspondence import FlatBrain
from flyreg_core.landmarks import HALVES, SHARED_CURVES
from flyreg_core.mesh import Floats, Integers
from flyreg_core.normals import face_normals
from flyreg_core.results import Results

REACH_UM = 5.0
"""How far from the seam faces still tell how a half runs into it: about a voxel."""


@dataclass(frozen=True)
class AlongCurve:
    """Values along curves, each counting as much as the length that it stands for."""

    mean: float
    p95: float
    largest: float

    @classmethod
    def of(cls, values: Floats, lengths: Floats) -> AlongCurve:
        """Return the summary of (k,) values that stand for (k,) lengths."""
        order = np.argsort(values)
        reached = np.cumsum(lengths[order]) / lengths.sum()
        p95 = values[order[min(int(np.searchsorted(reached, 0.95)), len(order) - 1)]]
        return cls(float(values @ lengths / lengths.sum()), float(p95), float(values.max()))


@dataclass(frozen=True)
class Seam:
    """How the halves meet on the registered surface, and on the target."""

    registered_degrees: AlongCurve
    target_degrees: AlongCurve
    hole_to_target_um: AlongCurve  # from the registered curve of the hole to the target's
    hole_from_target_um: AlongCurve


def examine_seam(results: Results) -> Seam:
    """Return the angles across the seam of both surfaces, and how far apart the holes' curves are."""
    source, target = results.source.flat, results.target.flat
    moved, fixed = results.registration.surface.vertices, target.dissection.surface.vertices
    own, other = hole_chain(moved, source), hole_chain(fixed, target)
    return Seam(
        *(
            AlongCurve.of(angles_across_seam(vertices, brain), _lengths(vertices, brain))
            for vertices, brain in ((moved, source), (fixed, target))
        ),
        *(
            AlongCurve.of(distances_to_chain(a, b), np.linalg.norm(np.diff(a, axis=0), axis=1))
            for a, b in ((own, other), (other, own))
        ),
    )


def seam_vertices(brain: FlatBrain) -> Integers:
    """Return the vertices along which both halves meet, growing: upper, lower and around the hole."""
    return np.unique(np.concatenate([brain.curves[name, None].vertices for name in SHARED_CURVES]))


def hole_chain(vertices: Floats, brain: FlatBrain) -> Floats:
    """Return the (c, 3) points of the hole's curve, the last being the first, of moved vertices."""
    return np.asarray(vertices[brain.curves["hole", None].vertices])


def angles_across_seam(vertices: Floats, brain: FlatBrain) -> Floats:
    """Return by how much the surface turns from one half to the other, in degrees: 0 where it is level.

    Parameters
    ----------
    vertices : (n, 3) float
        Where the brain's vertices lie, micrometres: its own places, or the registered ones.

    Returns
    -------
    (k,) float
        At `seam_vertices`, the angle between the halves' mean normals within `REACH_UM`. The faces
        at the seam alone would tell nothing: the cut runs through faces, so that before registration
        both sides of an edge are level.
    """
    seam = seam_vertices(brain)
    one, other = (_mean_normals(vertices, brain.dissection.faces_of(half), seam) for half in HALVES)
    sine = np.linalg.norm(np.cross(one, other), axis=1)
    return np.asarray(np.degrees(np.arctan2(sine, np.einsum("ij,ij->i", one, other))))


def distances_to_chain(chain: Floats, other: Floats) -> Floats:
    """Return how far the c - 1 edges between (c, 3) points are from the edges between (d, 3) others.

    The farthest of both ends and the middle counts: registered ends lie on the target by construction.
    """
    middles = (chain[:-1] + chain[1:]) / 2
    *_, ends = nearest_on_chain(chain, other)
    *_, between = nearest_on_chain(middles, other)
    return np.maximum(np.maximum(ends[:-1], ends[1:]), between)


def _mean_normals(vertices: Floats, faces: Integers, seam: Integers) -> Floats:
    """Return the sum of the normals of the faces around or near each vertex of the seam, by area."""
    middles = KDTree(vertices[faces].mean(axis=1))
    near = KDTree(vertices[seam]).sparse_distance_matrix(
        middles, REACH_UM, output_type="coo_matrix"
    )
    around, corner = np.nonzero(np.isin(faces, seam))
    rows = np.concatenate([near.row, np.searchsorted(seam, faces[around, corner])])
    columns = np.concatenate([near.col, around])
    counted = sparse.csr_matrix((np.ones(len(rows)), (rows, columns)), (len(seam), len(faces)))
    counted.data[:] = 1.0  # a face that is both around and near is one face
    return np.asarray(counted @ face_normals(vertices, faces))


def _lengths(vertices: Floats, brain: FlatBrain) -> Floats:
    """Return the length that each of `seam_vertices` stands for, half of the edges beside it."""
    lengths = np.zeros(len(vertices))
    for name in SHARED_CURVES:
        chain = brain.curves[name, None].vertices
        halves = np.linalg.norm(np.diff(vertices[chain], axis=0), axis=1) / 2
        np.add.at(lengths, chain[:-1], halves)
        np.add.at(lengths, chain[1:], halves)
    return lengths[seam_vertices(brain)]
