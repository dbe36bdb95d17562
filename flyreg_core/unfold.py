"""The least change that removes folds: flipped faces are laid flat again where they lie."""

from __future__ import annotations

import numpy as np

from flyreg_core.flatten import Springs, mean_matrix, solve_means
from flyreg_core.mesh import Booleans, FlatMesh, Integers
from flyreg_core.orientation import orientations
from flyreg_core.progress import Report

RELAXATIONS = 100
"""How often vertices of flipped faces move before more of them are freed."""

SMALL_STEPS = 20
"""How often one more ring around flipped faces is freed before ever wider ones are."""


def count_flipped(flat: FlatMesh) -> int:
    """Return how many faces are flipped or have no area, decided exactly."""
    return int((orientations(flat.corners) <= 0).sum())


def unfold(flat: FlatMesh, springs: Springs, is_fixed: Booleans, report: Report) -> FlatMesh:
    """Return the strip with folds removed by moving as few vertices as possible.

    Parameters
    ----------
    springs : Springs
        The net that laid the half flat; its weights say where a vertex is at rest.
    is_fixed : (n,) bool
        Vertices on the boundaries, which stay.

    Notes
    -----
    First the vertices of flipped faces, and no others, move to the means of their neighbours,
    again and again. Where that does not end, rings around flipped faces are freed and laid flat
    anew, in the end ever wider ones; when all are free the result is one-to-one by Tutte's theorem.
    """
    flat, flipped = _relax(flat, springs, is_fixed, report)
    freed = np.zeros(len(flat.uv), dtype=bool)
    width, tries = 1, 0
    while flipped.any() and not (freed | is_fixed).all():
        report(0.5, "removing folds")
        around = np.zeros(len(flat.uv), dtype=bool)
        around[flat.faces[flipped]] = True
        for _ in range(width):
            around = _grown(around, springs.edges)
        freed |= around & ~is_fixed
        u, v = solve_means(springs, ~freed, flat.uv[:, 0], flat.uv[:, 1])
        flat = FlatMesh(np.stack([u, v], axis=1), flat.faces, flat.corner_shifts)
        flipped = orientations(flat.corners) <= 0
        tries += 1
        width = width if tries < SMALL_STEPS else 2 * width
    return flat


def _relax(
    flat: FlatMesh, springs: Springs, is_fixed: Booleans, report: Report
) -> tuple[FlatMesh, Booleans]:
    """Move vertices of flipped faces to the means of their neighbours; tell what stays flipped."""
    flipped = orientations(flat.corners) <= 0
    if not flipped.any():
        return flat, flipped
    means, charge = mean_matrix(springs, len(flat.uv))
    uv = np.array(flat.uv)
    is_moved = np.zeros(len(uv), dtype=bool)
    for done in range(RELAXATIONS):
        report(done / RELAXATIONS, "removing folds")
        moving = np.unique(flat.faces[flipped])
        moving = moving[~is_fixed[moving]]
        uv[moving] = means[moving] @ uv
        uv[moving, 0] += charge[moving]
        is_moved[moving] = True
        watched = np.flatnonzero(is_moved[flat.faces].any(axis=1) | flipped)
        corners = uv[flat.faces[watched]]
        corners[..., 0] += flat.corner_shifts[watched]
        flipped[watched] = orientations(corners) <= 0
        if not flipped.any():
            break
    return FlatMesh(uv, flat.faces, flat.corner_shifts), flipped


def _grown(chosen: Booleans, edges: Integers) -> Booleans:
    first, second = edges.T
    touched = chosen[first] | chosen[second]
    grown = chosen.copy()
    grown[first[touched]] = grown[second[touched]] = True
    return grown
