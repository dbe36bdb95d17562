"""A stage of the pipeline that remembers what it made."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Generic, TypeVar

from flyreg_core.progress import Report

T = TypeVar("T")


class Memo(Generic[T]):
    """One stage of the pipeline with its last arguments and results.

    Arguments are compared with `==`: parameters by value, geometry by identity. A stage that is
    cancelled or fails leaves what was remembered untouched.
    """

    def __init__(self, name: str, stage: Callable[..., T], capacity: int = 1) -> None:
        self.name, self.seconds = name, 0.0
        self._stage, self._capacity = stage, capacity
        self._remembered: list[tuple[tuple[object, ...], T]] = []

    def __call__(self, *arguments: object, report: Report) -> T:
        """Return the stage's result for these arguments, computed or remembered."""
        for place, (known, result) in enumerate(self._remembered):
            if known == arguments:
                used = self._remembered.pop(place)
                self._remembered.insert(0, used)  # the last one to be forgotten
                return result
        started = perf_counter()
        result = self._stage(*arguments, report=report)
        self.seconds += perf_counter() - started
        self._remembered = [(arguments, result), *self._remembered][: self._capacity]
        return result

    def knows(self, *arguments: object) -> bool:
        """Tell whether the result for these arguments is remembered."""
        return any(known == arguments for known, _ in self._remembered)
