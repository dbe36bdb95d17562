"""flyreg beside its rivals on all ordered pairs of five templates, as a table in Markdown.

FLYREG_PAIRS names other pairs, such as "FCWB JFRC2, JFRC2 FCWB"; FLYREG_METHODS other methods;
FLYREG_OPTIONS other options of the command, such as "--vertices 300000 --time-limit 300".
"""

from __future__ import annotations

import itertools
import json
import os
import subprocess
import sys
from typing import Any

import pytest

TEMPLATES = ("FCWB", "JFRC2", "IS2", "JRC2018F", "FAFB14")
METHODS = "none,icp-affine,flyreg"
COLUMNS = ("pair", "method", "mean to target, um", "and back", "times ours", "folded, %", "s", "MB")
MOST_MEGABYTES = 3000


def pairs() -> list[tuple[str, str]]:
    named = os.environ.get("FLYREG_PAIRS")
    if not named:
        return list(itertools.permutations(TEMPLATES, 2))
    return [(pair.split()[0], pair.split()[1]) for pair in named.split(",")]


def compared(source: str, target: str) -> list[dict[str, Any]]:
    """Compare on one pair, as a process of its own."""
    methods = os.environ.get("FLYREG_METHODS", METHODS)
    options = os.environ.get("FLYREG_OPTIONS", "").split()
    command = [sys.executable, "-m", "flyreg_core.cli", "compare", source, target, "--json"]
    done = subprocess.run(
        [*command, "--methods", methods, *options], capture_output=True, text=True, check=True
    )
    rows: list[dict[str, Any]] = json.loads(done.stdout)["rows"]
    return rows


def cells(pair: str, row: dict[str, Any], ours: dict[str, Any]) -> list[str]:
    if row["status"] != "done":
        return [pair, row["method"], row["status"], *[""] * (len(COLUMNS) - 3)]
    means = row["mean_um"], row["target_to_source"]["mean_um"]
    least = min(means[0] / ours["mean_um"], means[1] / ours["target_to_source"]["mean_um"])
    return [
        *(pair, row["method"], *(f"{mean:.4g}" for mean in means), f"{least:.0f}"),
        *(f"{100 * row['folded_share']:.2f}", f"{row['seconds']:.0f}"),
        f"{row['peak_memory_mb']:.0f}",
    ]


def test_flyreg_lies_closer_than_any_rival_on_every_pair(
    capsys: pytest.CaptureFixture[str],
) -> None:
    found = {}
    with capsys.disabled():
        print("\n| " + " | ".join(COLUMNS) + " |\n" + "|---" * len(COLUMNS) + "|")
        for source, target in pairs():
            found[source, target] = compared(source, target)
            ours = next(row for row in found[source, target] if row["method"] == "flyreg")
            for row in found[source, target]:
                line = cells(f"{source} → {target}", row, ours)
                print("| " + " | ".join(line) + " |", flush=True)
    for rows in found.values():
        done = {row["method"]: row for row in rows if row["status"] == "done"}
        flyreg = done.pop("flyreg")
        assert flyreg["peak_memory_mb"] < MOST_MEGABYTES
        for rival in done.values():
            assert flyreg["mean_um"] < rival["mean_um"]
            assert flyreg["target_to_source"]["mean_um"] < rival["target_to_source"]["mean_um"]
