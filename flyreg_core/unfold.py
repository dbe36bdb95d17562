"""The least change that removes folds: flipped faces are laid flat again where they lie."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from scipy import sparse

from flyreg_core.flatten import Springs, mean_matrix, solve_means
from flyreg_core.mesh import Booleans, FlatMesh, Floats, Integers
from flyreg_core.orientation import UNDECIDED, flipped_faces, sign_of_triangle
from flyreg_core.progress import Report

RELAXATIONS = 400
"""How often vertices of flipped faces move before more of them are freed."""

AT_ONCE = 100
"""Relaxations between two reports."""

SMALL_STEPS = 20
"""How often one more ring around flipped faces is freed before ever wider ones are."""


@dataclass(frozen=True, eq=False)
class Net:
    """What holds a half laid flat, and what mending its folds looks up there, made once."""

    springs: Springs
    faces: Integers  # (m, 3)

    @cached_property
    def means(self) -> tuple[sparse.csr_array, Floats]:
        """Return the matrix that takes u and v to weighted means, and what to add to u."""
        return mean_matrix(self.springs, int(self.faces.max()) + 1)

    @cached_property
    def faces_around(self) -> tuple[Integers, Integers]:
        """Return where the faces of each vertex start in the second array, and these faces."""
        corners = self.faces.reshape(-1)
        starts = np.concatenate([[0], np.cumsum(np.bincount(corners))])
        return starts, np.argsort(corners, kind="stable") // 3


@dataclass(frozen=True, eq=False)
class Unfolded:
    """A half whose folds are mended."""

    flat: FlatMesh
    folds: int  # faces flipped before
    flipped: int  # and those that still are


def count_flipped(flat: FlatMesh) -> int:
    """Return how many faces are flipped or have no area, decided exactly."""
    return int(flipped_faces(flat).sum())


def unfold(flat: FlatMesh, net: Net, is_fixed: Booleans, report: Report) -> Unfolded:
    """Return the strip with folds removed by moving as few vertices as possible.

    Parameters
    ----------
    net : Net
        What laid the half flat; the weights of its springs say where a vertex is at rest.
    is_fixed : (n,) bool
        Vertices on the boundaries, which stay.

    Notes
    -----
    First the vertices of flipped faces, and no others, move to the means of their neighbours,
    again and again. Where that does not end, rings around flipped faces are freed and laid flat
    anew, and what is flipped then moves as before; in the end rings are ever wider, and when all are
    free the result is one-to-one by Tutte's theorem.
    """
    flipped = flipped_faces(flat)
    folds = int(flipped.sum())
    if not folds:
        return Unfolded(flat, 0, 0)
    flat, flipped = _relax(flat, flipped, net, is_fixed, report)
    freed = np.zeros(len(flat.uv), dtype=bool)
    width, tries = 1, 0
    while flipped.any() and not (freed | is_fixed).all():
        report(0.5, "removing folds")
        around = np.zeros(len(flat.uv), dtype=bool)
        around[flat.faces[flipped]] = True
        for _ in range(width):
            around = _grown(around, net.springs.edges)
        freed |= around & ~is_fixed
        u, v = solve_means(net.springs, ~freed, flat.uv[:, 0], flat.uv[:, 1])
        flat = flat.moved(np.stack([u, v], axis=1))
        flat, flipped = _relax(flat, flipped_faces(flat), net, is_fixed, report)
        tries += 1
        width = width if tries < SMALL_STEPS else 2 * width
    return Unfolded(flat, folds, int(flipped.sum()))


def _relax(
    flat: FlatMesh, flipped: Booleans, net: Net, is_fixed: Booleans, report: Report
) -> tuple[FlatMesh, Booleans]:
    """Move vertices of flipped faces to the means of their neighbours; tell what stays flipped."""
    means, charge = net.means
    starts, around = net.faces_around
    uv, flipped = np.array(flat.uv), flipped.copy()
    for done in range(0, RELAXATIONS, AT_ONCE):
        report(done / RELAXATIONS, "removing folds")
        _relax_rounds(
            uv,
            flat.faces,
            flat.corner_shifts,
            is_fixed,
            means.indptr,  # type: ignore[arg-type]
            means.indices,  # type: ignore[arg-type]
            means.data,
            charge,
            starts,
            around,
            flipped,
            AT_ONCE,
        )
        if not flipped.any():
            break
    return flat.moved(uv), flipped


@njit(nogil=True, cache=True)
def _relax_rounds(
    uv: Floats,
    faces: Integers,
    shifts: Integers,
    is_fixed: Booleans,
    first: Integers,
    neighbours: Integers,
    weights: Floats,
    charge: Floats,
    starts: Integers,
    around: Integers,
    flipped: Booleans,
    rounds: int,
) -> None:
    """Relax `uv` and `flipped` in place, all vertices of flipped faces at once in each round."""
    bad = np.flatnonzero(flipped)
    seen_vertex = np.full(len(uv), -1, dtype=np.int16)
    seen_face = np.full(len(faces), -1, dtype=np.int16)
    for done in range(rounds):
        moving = [0 for _ in range(0)]
        for face in bad:
            for corner in range(3):
                vertex = faces[face, corner]
                if not is_fixed[vertex] and seen_vertex[vertex] != done:
                    seen_vertex[vertex] = done
                    moving.append(vertex)
        moved = np.zeros((len(moving), 2))
        for k, vertex in enumerate(moving):
            moved[k, 0] = charge[vertex]
            for place in range(first[vertex], first[vertex + 1]):
                moved[k, 0] += weights[place] * uv[neighbours[place], 0]
                moved[k, 1] += weights[place] * uv[neighbours[place], 1]
        touched = list(bad)
        for face in bad:
            seen_face[face] = done
        for k, vertex in enumerate(moving):
            uv[vertex, 0], uv[vertex, 1] = moved[k, 0], moved[k, 1]
            for place in range(starts[vertex], starts[vertex + 1]):
                face = around[place]
                if seen_face[face] != done:
                    seen_face[face] = done
                    touched.append(face)
        bad = np.array(touched)
        for face in bad:
            a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
            sign = sign_of_triangle(
                uv[a, 0] + shifts[face, 0],
                uv[a, 1],
                uv[b, 0] + shifts[face, 1],
                uv[b, 1],
                uv[c, 0] + shifts[face, 2],
                uv[c, 1],
            )
            flipped[face] = sign <= 0 or sign == UNDECIDED
        bad = bad[flipped[bad]]
        if len(bad) == 0:
            return


def _grown(chosen: Booleans, edges: Integers) -> Booleans:
    first, second = edges.T
    touched = chosen[first] | chosen[second]
    grown = chosen.copy()
    grown[first[touched]] = grown[second[touched]] = True
    return grown
