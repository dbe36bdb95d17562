"""Stage 6 under the hand: one spline at many points, kept up to date while little of it changes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from flyreg_core.mesh import Booleans, Floats, Integers
from flyreg_core.progress import Report, in_chunks
from flyreg_core.smoothing_table import LEAST_SMOOTHING, MOST_SMOOTHING, SmoothingTable
from flyreg_core.thin_plate_spline import (
    LEAST_WEIGHT,
    ThinPlateSpline,
    affine_basis,
    check_landmarks,
    fit_thin_plate_spline,
    kernel,
    make_system,
)

MOST_BYTES = 512 * 2**20
"""A larger kernel between points and landmarks is not kept but computed again whenever it is used."""
MOST_CHANGED = 100
"""If more landmarks differ from the last full solution, a new one is found; as many fields are kept."""
SPARE = 32
"""Places for landmarks to come, so that one more does not move all that is kept."""


@dataclass(frozen=True)
class Demand:
    """What a spline is asked to do, a row per place for a landmark; weight 0 where it is not used."""

    targets: Floats  # (m, 2)
    weights: Floats  # (m,)
    smoothing: float

    def has_landmarks_of(self, other: Demand) -> bool:
        """Tell whether only the smoothing differs."""
        return np.array_equal(self.weights, other.weights) and np.array_equal(
            self.targets[self.weights > 0], other.targets[other.weights > 0]
        )


@dataclass(eq=False)
class _Held:
    """A full solution, and how it changes with what was touched since."""

    demand: Demand
    spline: ThinPlateSpline
    values: Floats  # (n, 2)
    used: Integers  # (k,), rows of the demand
    inverse: Floats | None = None  # (k + 3, k + 3), of the bordered system
    fields: dict[int, Floats] = field(default_factory=dict)  # row -> (n,), d values / d target


class LiveSpline:
    """A thin-plate spline at fixed points, equal to a new solution at each call, but much sooner.

    Parameters
    ----------
    points : (n, 2) float
        Where the spline is evaluated.

    Notes
    -----
    Everything is exact, nothing adds up: each answer is the last full solution and one correction.
    A weight or a target that changes moves the solution along one fixed direction, whose field over
    the points is kept (Sherman, Morrison, Woodbury); k touched landmarks cost k additions of fields
    and a system of size k. If the smoothing alone changes, a table along it is made once and read
    between its nodes (`SmoothingTable`). Landmarks that come or move on the source need a new full
    solution, of which the kernel is kept.

    References
    ----------
    Hager, Updating the inverse of a matrix, SIAM Review 31(2), 1989, doi:10.1137/1031049.
    """

    def __init__(self, points: Floats, most_bytes: int = MOST_BYTES) -> None:
        self._points, self._affine = points, affine_basis(points)
        self._most_bytes = most_bytes
        self._centers = np.zeros((0, 2))
        self._row_of: dict[tuple[float, float, int], int] = {}
        self._sources, self._rows = np.zeros((0, 2)), np.zeros(0, dtype=np.int64)
        self._kernel: Floats | None = None  # (m, n)
        self._held: _Held | None = None
        self._last: Demand | None = None
        self._table: tuple[Demand, SmoothingTable] | None = None

    def __call__(
        self, sources: Floats, targets: Floats, weights: Floats, smoothing: float, report: Report
    ) -> Floats:
        """Return the (n, 2) places to which the spline of (k, 2) landmarks takes the points.

        Raises
        ------
        LandmarkError
            As `fit_thin_plate_spline`.
        """
        demand = self._demand(sources, targets, weights, smoothing)
        values = self._answer(demand, report)
        self._last = demand
        return values

    def _demand(
        self, sources: Floats, targets: Floats, weights: Floats, smoothing: float
    ) -> Demand:
        check_landmarks(sources, targets, weights, smoothing)
        if not np.array_equal(sources, self._sources):
            self._sources, self._rows = sources.copy(), self._find_rows(sources)
        rows = self._rows
        at, pull = np.zeros(self._centers.shape), np.zeros(len(self._centers))
        at[rows], pull[rows] = targets, np.where(weights > LEAST_WEIGHT, weights, 0.0)
        return Demand(at, pull, smoothing)

    def _answer(self, demand: Demand, report: Report) -> Floats:
        held, last = self._held, self._last
        touched = None if held is None else _touched(held, demand)
        if held is not None and touched is not None:
            return self._corrected(held, touched, demand, report)
        is_in_table = LEAST_SMOOTHING <= demand.smoothing <= MOST_SMOOTHING
        if is_in_table and last is not None and demand.has_landmarks_of(last):
            return self._from_table(demand, report)
        self._held = self._solved(demand, report)
        return self._held.values

    # Where landmarks are kept

    def _find_rows(self, sources: Floats) -> Integers:
        """Return the row of each landmark; those that were never here get one."""
        keys = []
        count: dict[tuple[float, float], int] = {}
        for x, y in sources.tolist():
            number = count[x, y] = count.get((x, y), -1) + 1
            keys.append((x, y, number))
        missing = [key for key in keys if key not in self._row_of]
        if missing:
            self._add(missing, set(keys))
        return np.array([self._row_of[key] for key in keys], dtype=np.int64)

    def _add(self, missing: list[tuple[float, float, int]], kept: set[object]) -> None:
        """Give new landmarks the rows of landmarks that are gone, or else spare ones."""
        self._held = self._last = self._table = None
        self._row_of = {key: row for key, row in self._row_of.items() if key in kept}
        free = sorted(set(range(len(self._centers))) - set(self._row_of.values()))
        lacking = len(missing) - len(free)
        if lacking > 0:
            first = len(self._centers)
            more = lacking + SPARE
            self._centers = np.concatenate([self._centers, np.zeros((more, 2))])
            free += range(first, first + more)
            self._resize()
        rows = np.array(free[: len(missing)])
        self._row_of |= dict(zip(missing, rows.tolist(), strict=True))
        self._centers[rows] = [key[:2] for key in missing]
        if self._kernel is not None:
            for row in rows:
                self._kernel[row] = kernel(self._points, self._centers[[row]])[:, 0]

    def _resize(self) -> None:
        shape = (len(self._centers), len(self._points))
        if 8 * shape[0] * shape[1] > self._most_bytes:
            self._kernel = None
            return
        grown = np.zeros(shape)
        known = 0 if self._kernel is None else len(self._kernel)
        if self._kernel is not None:
            grown[:known] = self._kernel
        else:
            for row in self._row_of.values():
                grown[row] = kernel(self._points, self._centers[[row]])[:, 0]
        self._kernel = grown

    # What is evaluated

    def _evaluate(self, bending: Floats, affine: Floats, rows: Integers, report: Report) -> Floats:
        """Return the (n, d) sum of (k, d) bumps at the centers of some rows and (3, d) affine parts."""
        if self._kernel is not None:
            whole = np.zeros((len(self._centers), bending.shape[1]))
            whole[rows] = bending
            return np.asarray(self._kernel.T @ whole + self._affine @ affine)
        centers = self._centers[rows]
        parts = in_chunks(
            lambda part: kernel(part, centers) @ bending, self._points, report, "bending"
        )
        return np.asarray(parts + self._affine @ affine)

    # The routes

    def _solved(self, demand: Demand, report: Report) -> _Held:
        """Return a full solution."""
        used = np.flatnonzero(demand.weights > 0)
        spline = fit_thin_plate_spline(
            self._centers, demand.targets, demand.weights, demand.smoothing
        )
        values = self._evaluate(spline.bending[used], spline.affine, used, report)
        return _Held(demand, spline, values, used)

    def _corrected(self, held: _Held, touched: Integers, demand: Demand, report: Report) -> Floats:
        """Return what becomes of values whose landmarks' weights and targets change.

        With G the inverse of the bordered system and D the change of its diagonal, both for the
        touched rows alone, the right side moves by the targets' steps less (1 / D + G)^-1 of what
        the bending would be then. A landmark that is left out has 1 / D = 0.
        """
        if len(touched) == 0:
            return held.values
        place = np.searchsorted(held.used, touched)
        inside = self._inverse(held)[np.ix_(place, place)]
        moved = demand.targets[touched] - held.demand.targets[touched]
        is_out = demand.weights[touched] == 0
        moved[is_out] = 0.0
        bending = held.spline.bending[touched] + inside @ moved
        slack = 1 / np.where(is_out, 1.0, demand.weights[touched])
        change = demand.smoothing * (slack - 1 / held.demand.weights[touched])
        change[is_out] = np.inf
        weighs = np.flatnonzero(change)
        system = inside[np.ix_(weighs, weighs)] + np.diag(1 / change[weighs])
        moved[weighs] -= np.linalg.solve(system, bending[weighs])
        values = held.values.copy()
        for amount, own in zip(moved, self._fields(held, touched, report), strict=True):
            values[:, 0] += amount[0] * own
            values[:, 1] += amount[1] * own
        return values

    def _inverse(self, held: _Held) -> Floats:
        if held.inverse is None:
            weights = held.demand.weights[held.used]
            system = make_system(self._centers[held.used], weights, held.demand.smoothing)
            held.inverse = np.asarray(np.linalg.inv(system), float)
        return held.inverse

    def _fields(self, held: _Held, touched: Integers, report: Report) -> list[Floats]:
        """Return how the values change with the target of each touched landmark, made once."""
        new = np.array([row for row in touched.tolist() if row not in held.fields], dtype=np.int64)
        if len(new):
            columns = self._inverse(held)[:, np.searchsorted(held.used, new)]
            count = len(held.used)
            made = self._evaluate(columns[:count], columns[count:], held.used, report)
            if len(held.fields) + len(new) > MOST_CHANGED:
                kept = set(touched.tolist())
                held.fields = {row: own for row, own in held.fields.items() if row in kept}
            held.fields |= dict(zip(new.tolist(), np.ascontiguousarray(made.T), strict=True))
        return [held.fields[row] for row in touched.tolist()]

    def _from_table(self, demand: Demand, report: Report) -> Floats:
        if self._table is None or not self._table[0].has_landmarks_of(demand):
            self._table = demand, self._tabulated(demand, report)
        return self._table[1](demand.smoothing)

    def _tabulated(self, demand: Demand, report: Report) -> SmoothingTable:
        used = np.flatnonzero(demand.weights > 0)
        return SmoothingTable.make(
            self._centers[used],
            demand.targets[used],
            demand.weights[used],
            lambda bending, affine: self._evaluate(bending, affine, used, report),
        )


def _touched(held: _Held, demand: Demand) -> Integers | None:
    """Return the rows that differ from a solution; None if it cannot be corrected for them."""
    if demand.smoothing != held.demand.smoothing:
        return None
    differs: Booleans = (demand.weights != held.demand.weights) | (
        (demand.targets != held.demand.targets).any(axis=1) & (demand.weights > 0)
    )
    touched = np.flatnonzero(differs)
    if len(touched) > MOST_CHANGED or (held.demand.weights[touched] == 0).any():
        return None
    return touched
