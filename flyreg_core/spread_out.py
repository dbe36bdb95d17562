"""Some of many points, far from each other."""

from __future__ import annotations

import numpy as np
from numba import njit

from flyreg_core.mesh import Floats, Integers


def spread_out(points: Floats, count: int) -> Integers:
    """Return the numbers of up to `count` (n, 3) points, each the farthest from all before it."""
    return _spread_out(np.ascontiguousarray(points), min(count, len(points)))


@njit(nogil=True, cache=True)
def _spread_out(points: Floats, count: int) -> Integers:
    chosen = np.zeros(count, dtype=np.int64)
    away = np.full(len(points), np.inf)
    for number in range(1, count):
        x, y, z = points[chosen[number - 1]]
        farthest = 0
        for k in range(len(points)):
            dx, dy, dz = points[k, 0] - x, points[k, 1] - y, points[k, 2] - z
            away[k] = min(away[k], np.sqrt(dx * dx + dy * dy + dz * dz))
            if away[k] > away[farthest]:
                farthest = k
        chosen[number] = farthest
    return chosen
