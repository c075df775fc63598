"""BLAS has one thread while a cell runs in a program, and as many as before afterwards."""

from __future__ import annotations

import threading

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import lsds
from lsds.support.blas import VARIABLES, one_blas_thread


def blas_threads():
    """Return the number of threads of NumPy's BLAS, which cells use.

    Other tests load that of SciPy, and MKL, which has a separate number in each thread.
    """
    of_blas = [pool for pool in threadpool_info() if pool["user_api"] == "blas"]
    return {pool["num_threads"] for pool in of_blas if "numpy.libs" in pool["filepath"]}


@pytest.fixture
def two_threads(monkeypatch):
    for variable in VARIABLES:
        monkeypatch.delenv(variable, raising=False)
    with threadpool_limits(limits=2, user_api="blas"):
        if blas_threads() != {2}:
            pytest.skip("this machine, or its BLAS, has only one thread")
        yield


def test_a_run_uses_one_thread_and_gives_the_others_back(two_threads):
    during = []
    lsds.run({"task.lift_s": 0.2, "task.hold_s": 0.1}, observe=lambda cycle: during.append(blas_threads()))
    assert during
    assert all(threads == {1} for threads in during)
    assert blas_threads() == {2}


def test_a_cell_brought_up_step_by_step_uses_one_thread_too(two_threads):
    with lsds.bring_up():
        assert blas_threads() == {1}
    assert blas_threads() == {2}


def test_a_number_in_the_environment_stays(two_threads, monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "2")
    with one_blas_thread():
        assert blas_threads() == {2}


def test_an_error_gives_the_threads_back(two_threads):
    with pytest.raises(ValueError, match="no"), one_blas_thread():
        raise ValueError("no")
    assert blas_threads() == {2}


def test_runs_that_overlap_give_the_threads_back(two_threads):
    entered, may_end = threading.Event(), threading.Event()
    threads = []

    def other():
        with one_blas_thread():
            entered.set()
            may_end.wait(10)
        threads.append(blas_threads())

    thread = threading.Thread(target=other)
    with one_blas_thread():
        thread.start()
        assert entered.wait(10)
        assert blas_threads() == {1}
    may_end.set()
    thread.join(10)
    assert threads == [{2}]
    assert blas_threads() == {2}
    with one_blas_thread():
        assert blas_threads() == {1}
