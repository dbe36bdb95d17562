"""The least change that removes folds: flipped faces are laid flat again where they lie."""

from __future__ import annotations

import numpy as np

from flyreg_core.flatten import Springs, solve_means
from flyreg_core.mesh import Booleans, FlatMesh, Integers
from flyreg_core.orientation import orientations
from flyreg_core.progress import Report


def count_flipped(flat: FlatMesh) -> int:
    """Return how many faces are flipped or have no area, decided exactly."""
    return int((orientations(flat.corners) <= 0).sum())


def unfold(flat: FlatMesh, springs: Springs, is_fixed: Booleans, report: Report) -> FlatMesh:
    """Return the strip with folds removed by moving as few vertices as possible.

    Parameters
    ----------
    springs : Springs
        The net that laid the half flat; it decides where freed vertices come to rest.
    is_fixed : (n,) bool
        Vertices on the boundaries, which stay.

    Notes
    -----
    Frees the vertices of flipped faces and of ever wider rings around them and puts each at the
    mean of its neighbours. When all are free the result is one-to-one by Tutte's theorem, so the
    loop ends; in practice a few rings do.
    """
    flipped = orientations(flat.corners) <= 0
    freed = np.zeros(len(flat.uv), dtype=bool)
    width = 1
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
        width *= 2
    return flat


def _grown(chosen: Booleans, edges: Integers) -> Booleans:
    first, second = edges.T
    touched = chosen[first] | chosen[second]
    grown = chosen.copy()
    grown[first[touched]] = grown[second[touched]] = True
    return grown
