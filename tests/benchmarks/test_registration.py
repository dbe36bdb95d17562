"""What registering a real pair costs: time is printed, memory is bounded by what a laptop has."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

MOST_MEGABYTES = 3000


@pytest.mark.parametrize(("source", "target"), [("FCWB", "JFRC2"), ("JFRC2", "FCWB")])
def test_registering_two_templates_fits_a_laptop(
    source: str, target: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = [sys.executable, "-m", "flyreg_core.cli", "register", source, target, "--json"]
    done = subprocess.run(
        [*command, "-o", str(tmp_path)], capture_output=True, text=True, check=True
    )
    report = json.loads(done.stdout)
    seconds, megabytes = report["seconds"]["total"], report["peak_memory_mb"]
    stages = {name: round(t, 1) for name, t in report["seconds"]["by_stage"].items() if t >= 0.1}
    with capsys.disabled():
        print(f"\n{source} -> {target}: {seconds:.1f} s, {megabytes:.0f} MB, of which {stages}")
    assert megabytes is None or megabytes <= MOST_MEGABYTES
