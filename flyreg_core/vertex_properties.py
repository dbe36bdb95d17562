"""What the registered mesh tells of each vertex beside its place."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

from flyreg_core.landmarks import HALVES
from flyreg_core.mesh import Floats, Integers
from flyreg_core.results import Results

INFLUENCE_WIDTH = 0.2
"""Width in the rectangle over which a landmark's weight is shown to fade."""
PARTS = 20
"""So many parts of a half are looked at in turn: a table of all distances could fill the memory."""
STATUS = {"by the spline": 0, "on a curve": 1, "fold mended": 2, "on a cap": 3}
"""Values of the registered mesh's property `status`: how each vertex got its place."""


def weight_influence(results: Results) -> Floats:
    """Return for each vertex the landmarks' weights, faded with distance in the rectangle."""
    influence = np.zeros(len(results.source.surface.vertices))
    for half in HALVES:
        flat = results.source.halves[half]
        acting = [mark for mark in results.landmarks if half in mark.plane and mark.weight > 0]
        places = np.array([mark.plane[half][0] for mark in acting]).reshape(-1, 2)
        weights = np.array([mark.weight for mark in acting])
        for rows in np.array_split(np.arange(len(flat.vertex_of)), PARTS):
            away = cdist(flat.plane[rows], places, "sqeuclidean") / INFLUENCE_WIDTH**2
            influence[flat.vertex_of[rows]] += np.exp(-away / 2) @ weights
    return influence


def vertex_status(results: Results) -> Integers:
    """Return for each vertex of the registered mesh how it got its place, as `STATUS` numbers it."""
    status = np.full(len(results.source.surface.vertices), STATUS["on a cap"])
    for half in HALVES:
        flat, warped = results.source.halves[half], results.registration.halves[half]
        status[flat.vertex_of] = np.where(
            warped.is_mended, STATUS["fold mended"], STATUS["by the spline"]
        )
    for curve in results.source.flat.curves.values():
        status[curve.vertices] = STATUS["on a curve"]
    return status
