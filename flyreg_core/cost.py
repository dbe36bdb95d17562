"""What a run cost."""

from __future__ import annotations

import sys
from collections.abc import Mapping


def peak_memory_mb() -> float | None:
    """Return the largest memory this process has held, megabytes; None where it is not told."""
    try:
        import resource
    except ImportError:  # not on Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    per_mb = 1024**2 if sys.platform == "darwin" else 1024
    return round(peak / per_mb, 1)


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
