"""A comparison as JSON, as tables, and as files."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from flyreg_core.apart import Limits
from flyreg_core.brain_files import write_mesh
from flyreg_core.comparison import CANCELLED, Comparison, Row
from flyreg_core.comparison_pictures import PICTURE_TITLES, SIZE, draw_methods, on_one_sheet
from flyreg_core.facts import Facts
from flyreg_core.files import make_folder, write_atomically
from flyreg_core.picture import Picture, png_bytes, webp_bytes
from flyreg_core.project import BrainInput, Unit
from flyreg_core.report import distance_report, versions
from flyreg_core.report_page import fill_page

TEMPLATE = "comparison_page.html"
DIRECTIONS = ("source_to_target", "target_to_source")
HEADINGS = ("method", "s", "MB", "mean um", "rms um", "back um", "TRE um", "TRE p95", "folded %")


def comparison_report(
    comparison: Comparison, source: BrainInput, target: BrainInput, limits: Limits
) -> Facts:
    """Return a comparison as JSON has it.

    `mean_um` and `rms_um` are distances from the moved source to the target, as in the paper's
    Table 2; both directions are beside them.
    """
    return {
        "source": source.name,
        "target": target.name,
        "diagonal_um": comparison.target.diagonal,
        "rows": [row_report(row) for row in comparison.rows],
        "is_complete": comparison.is_complete,
        "preparation_seconds": comparison.preparation_seconds,
        "points_outside": comparison.points_outside,
        "limits": {"seconds": limits.seconds, "megabytes": limits.megabytes},
        "versions": versions(),
    }


def row_report(row: Row) -> Facts:
    """Return what one method came to as JSON has it."""
    distances: dict[str, Any] = dict.fromkeys(DIRECTIONS)
    if row.distances is not None:
        told = distance_report(row.distances, *DIRECTIONS)
        distances = {direction: told[direction] for direction in DIRECTIONS}
    there = distances["source_to_target"]
    errors = row.errors_um if row.errors_um is not None and len(row.errors_um) else None
    return {
        "method": row.method,
        "description": row.description,
        "status": row.status,
        "seconds": None if row.seconds is None else round(row.seconds, 2),
        "peak_memory_mb": row.peak_memory_mb,
        "mean_um": None if there is None else there["mean_um"],
        "rms_um": None if there is None else there["rms_um"],
        "tre_mean_um": None if errors is None else float(errors.mean()),
        "tre_p95_um": None if errors is None else float(np.percentile(errors, 95)),
        "folded_share": row.folded_share,
        **distances,
    }


def as_table(facts: Mapping[str, Any]) -> str:
    """Return a comparison as a table for people, with what they should know about it below."""
    cells = [HEADINGS, *(cells_of(row) for row in facts["rows"])]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = [
        "  ".join(
            cell.ljust(width) if place == 0 else cell.rjust(width)
            for place, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in cells
    ]
    for row, number in zip(facts["rows"], range(1, len(lines)), strict=True):
        if row["status"] != "done":
            lines[number] = f"{row['method'].ljust(widths[0])}  {row['status']}"
    return "\n".join((*lines, "", *remarks_on(facts)))


def remarks_on(facts: Mapping[str, Any]) -> Sequence[str]:
    """Return what people should know about a comparison, a sentence each."""
    remarks = [
        f"{facts['source']} on {facts['target']}: mean and rms from the moved source to the target, back "
        "the mean from target to source."
    ]
    if any(row["method"] == "flyreg" for row in facts["rows"]):
        remarks.append(
            "The other methods are given prepared brains; of flyreg's time "
            f"{facts['preparation_seconds']:.1f} s prepare them."
        )
    if not facts["is_complete"]:
        ended = [row["status"] != CANCELLED for row in facts["rows"]]
        remarks.append(f"Incomplete: it was cancelled after {sum(ended)} of {len(ended)} methods.")
    if facts["points_outside"]:
        remarks.append(
            f"{facts['points_outside']} of the points are too far from the main brain and are left out."
        )
    if not _has_errors(facts):
        remarks.append(
            "The target registration error (TRE) is measured where a file of corresponding points is "
            "given (--points)."
        )
    return remarks


def _has_errors(facts: Mapping[str, Any]) -> bool:
    """Tell whether there was anything to measure the target registration error on."""
    return any(row["tre_mean_um"] is not None for row in facts["rows"])


def cells_of(row: Mapping[str, Any]) -> tuple[str, ...]:
    """Return a row of the table for people, as `HEADINGS` has it."""
    back = row["target_to_source"]
    folded = row["folded_share"]
    return (
        row["method"],
        _number(row["seconds"], 1),
        _number(row["peak_memory_mb"], 0),
        _number(row["mean_um"], 3),
        _number(row["rms_um"], 3),
        _number(None if back is None else back["mean_um"], 3),
        _number(row["tre_mean_um"], 2),
        _number(row["tre_p95_um"], 2),
        _number(None if folded is None else 100 * folded, 3),
    )


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def write_comparison(
    folder: Path,
    comparison: Comparison,
    facts: Facts,
    unit: Unit,
    pictures: Mapping[str, Picture] | None = None,
) -> None:
    """Write a comparison as `compare.json`, `compare.csv`, `compare.html` and `compare.png`.

    The last has all methods on one sheet. Also `METHOD.ply` and `METHOD.png` for each method that
    came to an end, and `target.png`.

    Parameters
    ----------
    pictures : mapping, optional
        See `comparison_pictures.draw_methods`, if they are drawn already.

    Raises
    ------
    InputError
        A file cannot be written.
    """
    make_folder(folder)
    for row in comparison.rows:
        if row.surface is not None:
            write_mesh(folder / f"{row.method}.ply", row.surface, unit)
    if pictures is None:
        pictures = draw_methods(comparison)
    for name, picture in (*pictures.items(), ("compare", on_one_sheet(pictures))):
        write_atomically(folder / f"{name}.png", png_bytes(picture))
    write_atomically(folder / "compare.html", _as_page(facts, pictures))
    write_atomically(folder / "compare.csv", _as_csv(facts))
    write_atomically(folder / "compare.json", json.dumps(facts, indent=2) + "\n")


def _as_page(facts: Facts, pictures: Mapping[str, Picture]) -> str:
    """Return a comparison as a page that needs no other file."""
    read = json.loads(json.dumps(facts))
    files = {name: webp_bytes(picture) for name, picture in pictures.items()}
    more = {"titles": PICTURE_TITLES, "pictures": files, "size": SIZE}
    return fill_page(
        TEMPLATE, read, remarks=remarks_on(read)[1:], has_errors=_has_errors(read), **more
    )


def _as_csv(facts: Mapping[str, Any]) -> str:
    """Return the rows with one column for each number."""
    flat = [
        {
            **{key: value for key, value in row.items() if key not in DIRECTIONS},
            **{
                f"{direction}_{key}": value
                for direction in DIRECTIONS
                for key, value in (row[direction] or {}).items()
            },
        }
        for row in facts["rows"]
    ]
    text = io.StringIO()
    names = list(dict.fromkeys(name for row in flat for name in row))
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(flat)
    return text.getvalue()
