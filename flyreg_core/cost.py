"""What a run cost."""

from __future__ import annotations

import sys


def peak_memory_mb() -> float | None:
    """Return the largest memory this process has held, megabytes; None where it is not told."""
    try:
        import resource
    except ImportError:  # not on Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    per_mb = 1024**2 if sys.platform == "darwin" else 1024
    return round(peak / per_mb, 1)
