"""Pairs of source and registered vertices, from which navis and others can make a transform."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from flyreg_core.brain_checks import UM_PER_UNIT
from flyreg_core.errors import FlyregError
from flyreg_core.files import write_atomically
from flyreg_core.landmarks import HALVES
from flyreg_core.mesh import Integers
from flyreg_core.results import Results
from flyreg_core.spread_out import spread_out

PAIRS = 1000
COLUMNS = ("x", "y", "z", "x_registered", "y_registered", "z_registered")


def choose_vertices(results: Results, count: int = PAIRS) -> Integers:
    """Return up to `count` source vertices spread evenly over both halves; none of a trim cap.

    Raises
    ------
    FlyregError
        Fewer than 4 are asked for, which no spline of space passes through.
    """
    if count < 4:
        raise FlyregError(f"at least 4 vertex pairs are needed, not {count}")
    halves = results.source.halves
    inner = np.unique(np.concatenate([halves[half].vertex_of for half in HALVES]))
    return np.asarray(inner[spread_out(results.source.surface.vertices[inner], count)])


def write_vertex_pairs(path: Path, results: Results, count: int = PAIRS) -> int:
    """Write vertex pairs as CSV, each end in the unit and frame of its brain's file; tell how many.

    They say where the surface goes, for `navis.transforms.TPStransform`; far from it, inside the
    brain and beyond the trim planes, a spline through them only guesses.
    """
    chosen = choose_vertices(results, count)
    start = results.source.surface.vertices[chosen]
    end = results.registration.surface.vertices[chosen]
    units = (results.project.source.input.unit, results.project.target.input.unit)
    scaled = [points / UM_PER_UNIT[unit] for points, unit in zip((start, end), units, strict=True)]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows([repr(value) for value in row] for row in np.hstack(scaled).tolist())
    write_atomically(path, text.getvalue())
    return len(chosen)
