"""Dense linear algebra on one thread: several wait for each other longer than they work.

The matrices here are small, so a product takes milliseconds. Where another program works on one of
the cores, threads that divide such a product cost ten times what they save: a 900 x 900 Cholesky
factor took 19 ms on one thread and 100 to 170 ms on two, with one other process on two cores.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
T = TypeVar("T")


def on_one_thread(function: Callable[P, T]) -> Callable[P, T]:
    """Let a function, and what it calls, do dense linear algebra on one thread."""

    @functools.wraps(function)
    def limited(*arguments: P.args, **named: P.kwargs) -> T:
        with _libraries().limit(limits=1, user_api="blas"):
            return function(*arguments, **named)

    return limited


@functools.cache
def _libraries() -> ThreadpoolController:
    """Return what holds the libraries' threads; looking for them takes longer than a tick may."""
    return ThreadpoolController()
