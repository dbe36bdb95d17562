"""How far points that a registration did not know land from where they belong."""

from __future__ import annotations

import numpy as np

from flyreg_core.facts import Facts
from flyreg_core.point_files import PointPairs
from flyreg_core.report import register_report
from flyreg_core.results import Results
from flyreg_core.transform import REACH_UM, carry


def register_report_on(truth: PointPairs | None, results: Results) -> Facts:
    """Return what a registration did, and how far points land from where they belong if given."""
    facts = register_report(results)
    if truth is not None:
        facts["target_registration_error"] = target_registration_error(truth, results)
    return facts


def target_registration_error(
    truth: PointPairs, results: Results, reach_um: float = REACH_UM
) -> Facts:
    """Return the target registration error as the report has it.

    Parameters
    ----------
    truth : PointPairs
        Points of the source and where they belong in the target, micrometres, in the frames of the
        files; none of them should be among the landmarks.
    reach_um : float
        Points farther from the main brain's surface are not mapped, see `transform.carry`.

    Returns
    -------
    mapping
        How many points there are and how many of them are not mapped; mean, median and 95th
        percentile of the distances of the others, None if there is no other.

    References
    ----------
    Fitzpatrick, West, Maurer, Predicting error in rigid-body point-based registration, IEEE TMI
    17(5), 1998, doi:10.1109/42.736021: the error at points other than those registered by.
    """
    carried = carry(truth.source, results, reach_um)
    there = carried.is_mapped
    errors = np.linalg.norm(carried.points[there] - truth.target[there], axis=1)
    is_known = len(errors) > 0
    return {
        "points": len(there),
        "unmapped": int((~there).sum()),
        "mean_um": float(errors.mean()) if is_known else None,
        "median_um": float(np.median(errors)) if is_known else None,
        "p95_um": float(np.percentile(errors, 95)) if is_known else None,
    }
