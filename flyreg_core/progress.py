"""How long work tells how far it is; telling may also stop it."""

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T", bound=np.generic)

Report = Callable[[float, str], None]
"""Called with the fraction done (0 to 1) and what is being done; raises `Cancelled` to stop the work."""


def ignore(fraction: float, text: str) -> None:
    """Report to nobody."""


def within(report: Report, start: float, end: float) -> Report:
    """Return a report for a part of the work that spans `start` to `end` of the whole."""

    def report_part(fraction: float, text: str) -> None:
        report(start + (end - start) * fraction, text)

    return report_part


def in_chunks(
    query: Callable[[NDArray[np.float64]], NDArray[T]],
    points: NDArray[np.float64],
    report: Report,
    text: str,
    size: int = 20_000,
) -> NDArray[T]:
    """Return `query(points)`, asked in parts so that it can be cancelled.

    Compiled code can keep the interpreter's lock for a whole call; between parts the window is served.
    """
    parts = np.array_split(points, max(1, -(-len(points) // size)))
    answers = []
    for done, part in enumerate(parts):
        report(done / len(parts), text)
        answers.append(query(part))
    return np.concatenate(answers)
