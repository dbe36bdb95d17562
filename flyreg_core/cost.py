"""What a run cost."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

import psutil


def peak_memory_mb() -> float | None:
    """Return the largest memory this process has held, megabytes; None where it is not told."""
    if sys.platform.startswith("linux"):
        # getrusage would tell what the process that started this one held, if that was more
        lines = Path("/proc/self/status").read_text().splitlines()
        peaks = [line.split()[1] for line in lines if line.startswith("VmHWM:")]
        return round(int(peaks[0]) / 1024, 1) if peaks else None
    if sys.platform == "darwin":
        import resource

        return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2, 1)
    peak = getattr(psutil.Process().memory_info(), "peak_wset", None)
    return None if peak is None else round(peak / 1024**2, 1)


def with_cost(
    facts: Mapping[str, object], seconds: float, by_stage: Mapping[str, float]
) -> dict[str, object]:
    """Return facts with the time it took in all and by stage, and the most memory held."""
    stages = {name: round(value, 3) for name, value in by_stage.items()}
    return {
        **facts,
        "seconds": {"total": round(seconds, 2), "by_stage": stages},
        "peak_memory_mb": peak_memory_mb(),
    }
