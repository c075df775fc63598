from __future__ import annotations

import threading

import pytest

from lsds.contracts import Lifecycle
from lsds.contracts.lifecycle import LifecycleGuard
from lsds.errors import LifecycleError


def armed():
    guard = LifecycleGuard("hand-e")
    with guard.connecting():
        pass
    with guard.arming():
        pass
    return guard


def test_the_whole_life():
    guard = LifecycleGuard("hand-e")
    assert guard.state is Lifecycle.NEW
    with guard.connecting():
        assert guard.state is Lifecycle.NEW
    guard.require_readable()
    with guard.arming():
        pass
    guard.require_readable()
    guard.require_armed()
    with guard.disarming() as needed:
        assert needed
    assert guard.state is Lifecycle.CONNECTED
    with guard.disarming() as needed:
        assert not needed
    with guard.closing() as first:
        assert first
    with guard.closing() as first:
        assert not first
    assert guard.state is Lifecycle.CLOSED


@pytest.mark.parametrize(
    ("call", "state", "words"),
    [
        (lambda g: g.require_readable(), "new", "read.* while new .call connect"),
        (lambda g: g.require_armed(), "new", "command.* while new .call connect"),
        (lambda g: g.arming().__enter__(), "new", "arm.* while new .call connect"),
        (lambda g: g.require_armed(), "connected", "command.* while connected .call arm"),
        (lambda g: g.connecting().__enter__(), "connected", "connect.* while connected"),
        (lambda g: g.arming().__enter__(), "armed", "arm.* while armed .call disarm"),
        (lambda g: g.require_readable(), "closed", "read.* while closed .*final"),
        (lambda g: g.connecting().__enter__(), "closed", "connect.* while closed .*final"),
    ],
)
def test_a_call_in_the_wrong_state_is_an_error_with_a_remedy(call, state, words):
    guard = LifecycleGuard("hand-e")
    if state in ("connected", "armed"):
        with guard.connecting():
            pass
    if state == "armed":
        with guard.arming():
            pass
    if state == "closed":
        with guard.closing():
            pass
    with pytest.raises(LifecycleError, match=f"hand-e: {words}"):
        call(guard)


@pytest.mark.parametrize(("step", "before"), [("connecting", Lifecycle.NEW), ("arming", Lifecycle.CONNECTED)])
def test_a_step_up_that_fails_changes_nothing(step, before):
    guard = LifecycleGuard("x")
    if step == "arming":
        with guard.connecting():
            pass
    with pytest.raises(OSError, match="no power"), getattr(guard, step)():
        raise OSError("no power")
    assert guard.state is before


@pytest.mark.parametrize(("step", "after"), [("disarming", Lifecycle.CONNECTED), ("closing", Lifecycle.CLOSED)])
def test_a_step_down_that_fails_counts(step, after):
    guard = armed()
    with pytest.raises(OSError, match="gone"), getattr(guard, step)():
        raise OSError("gone")
    assert guard.state is after


def test_reading_the_state_never_waits_for_a_transition():
    guard = LifecycleGuard("x")
    entered, leave = threading.Event(), threading.Event()

    def slow():
        with guard.connecting():
            entered.set()
            leave.wait(5)

    thread = threading.Thread(target=slow)
    thread.start()
    assert entered.wait(5)
    assert guard.state is Lifecycle.NEW
    with pytest.raises(LifecycleError):
        guard.require_readable()
    leave.set()
    thread.join(5)
    assert guard.state is Lifecycle.CONNECTED


def test_one_of_many_threads_closes():
    guard, firsts = armed(), []
    barrier = threading.Barrier(8)

    def close():
        barrier.wait(5)
        with guard.closing() as first:
            firsts.append(first)

    threads = [threading.Thread(target=close) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(5)
    assert sorted(firsts) == [False] * 7 + [True]
