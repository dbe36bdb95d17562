"""Work that does not depend on each other, done at once: the one place of the core with threads.

What runs here are functions of values, most of their time in compiled code that holds no lock of the
interpreter; so the results are those of one after the other, in half the time on two cores.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from flyreg_core.landmarks import HALVES, HalfName
from flyreg_core.progress import Report, ignore

T = TypeVar("T")
R = TypeVar("R")

WORKERS = 2


def side_by_side(
    make: Callable[[T], R], items: Sequence[T], report: Report = ignore, text: str = ""
) -> list[R]:
    """Return `make` of each item; the first that raises ends them all."""
    made = []
    pool = ThreadPoolExecutor(WORKERS, "side by side")
    try:
        for done, result in enumerate(pool.map(make, items)):
            report(done / len(items), text)
            made.append(result)
    finally:
        pool.shutdown(cancel_futures=True)
    return made


def both(one: Callable[[], T], other: Callable[[], R]) -> tuple[T, R]:
    """Return what two calls return; if one raises, the other is waited for."""
    with ThreadPoolExecutor(1, "side by side") as pool:
        later = pool.submit(other)
        first = one()
        return first, later.result()


def both_halves(
    make: Callable[[HalfName, Report], R], report: Report = ignore
) -> dict[HalfName, R]:
    """Return `make` of each half; how far both are together is reported."""
    done = dict.fromkeys(HALVES, 0.0)

    def of_half(half: HalfName) -> R:
        def tell(fraction: float, text: str) -> None:
            done[half] = fraction
            report(sum(done.values()) / len(done), text)

        return make(half, tell)

    one, other = HALVES
    return dict(zip(HALVES, both(lambda: of_half(one), lambda: of_half(other)), strict=True))
