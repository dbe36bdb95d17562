"""Linear algebra stays on one thread as long as anybody needs that, whoever came first."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from flyreg_core.one_thread import on_one_thread


def threads() -> set[int]:
    """How many threads the libraries of dense linear algebra use now."""
    np.ones((2, 2)) @ np.ones((2, 2))
    return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}


def in_thread(work) -> threading.Thread:
    thread = threading.Thread(target=work)
    thread.start()
    return thread


@pytest.fixture(autouse=True)
def several():
    """How many threads there are without a limit, more than one; in the end nobody has set one."""
    before = threads()
    if before == {1}:
        pytest.skip("the libraries here have one thread")
    yield before
    assert on_one_thread(threads)() == {1}
    assert threads() == before


def test_a_function_has_one_thread_also_where_it_calls_another_and_gives_them_back(several):
    inner = on_one_thread(threads)
    outer = on_one_thread(lambda: (inner(), threads()))
    assert outer() == ({1}, {1})
    assert threads() == several


def test_who_comes_first_and_leaves_first_takes_the_limit_from_nobody(several):
    entered, leave, seen = threading.Event(), threading.Event(), []

    @on_one_thread
    def first():
        entered.set()
        leave.wait()

    @on_one_thread
    def second():
        leave.set()
        thread.join()
        seen.append(threads())

    thread = in_thread(first)
    entered.wait()
    second()
    assert seen == [{1}]
    assert threads() == several


def test_another_thread_that_once_set_a_limit_does_not_keep_it():
    done, end = threading.Event(), threading.Event()

    def set_and_stay():
        threadpool_limits(2, "blas")
        done.set()
        end.wait()

    thread = in_thread(set_and_stay)
    done.wait()
    assert on_one_thread(threads)() == {1}
    end.set()
    thread.join()


def test_an_error_gives_the_threads_back(several):
    @on_one_thread
    def fails():
        raise ValueError("as it must")

    with pytest.raises(ValueError, match="as it must"):
        fails()
    assert threads() == several
