"""Dense linear algebra on one thread: several wait for each other longer than they work.

The matrices here are small, so a product takes milliseconds. Where another program works on one of
the cores, threads that divide such a product cost ten times what they save: a 900 x 900 Cholesky
factor took 19 ms on one thread and 100 to 170 ms on two, with one other process on two cores.

It also makes results repeat to the last bit: a product of two threads is rounded otherwise.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import ParamSpec, TypeVar

from threadpoolctl import OpenBLASController, ThreadpoolController

P = ParamSpec("P")
T = TypeVar("T")


def on_one_thread(function: Callable[P, T]) -> Callable[P, T]:
    """Let a function, and what it calls, do dense linear algebra on one thread."""

    @functools.wraps(function)
    def limited(*arguments: P.args, **named: P.kwargs) -> T:
        with _LIMIT.held():
            return function(*arguments, **named)

    return limited


class _Limit:
    """The limit of the libraries: the first who needs it sets it, the last takes it back.

    It holds for the whole process. If each took it back for itself, one would take it from another
    who is still at work.
    """

    def __init__(self) -> None:
        self._lock, self._holders = threading.Lock(), 0
        self._take_back: Callable[[], None] = lambda: None

    @contextmanager
    def held(self) -> Iterator[None]:
        """Have the libraries work on one thread meanwhile."""
        with self._lock:
            if self._holders == 0:
                _let_any_thread_decide()
                limiter = _libraries().limit(limits=1, user_api="blas")
                self._take_back = limiter.restore_original_limits
            self._holders += 1
        try:
            yield
        finally:
            with self._lock:
                self._holders -= 1
                if self._holders == 0:
                    _let_any_thread_decide()
                    self._take_back()
                    _let_any_thread_decide()


_LIMIT = _Limit()


def _let_any_thread_decide() -> None:
    """Forget which thread set a limit first; newer threadpoolctl ignores all others without a word."""
    forget = getattr(OpenBLASController, "clear_controlling_thread", None)
    if forget is not None:
        forget(force=True)


@functools.cache
def _libraries() -> ThreadpoolController:
    """Return what holds the libraries' threads; looking for them takes longer than a tick may."""
    return ThreadpoolController()
