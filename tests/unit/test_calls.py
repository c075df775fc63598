"""The thread that calls devices: a call that hangs is named and abandoned, others are not disturbed."""

from __future__ import annotations

import contextvars
import gc
import threading

import pytest

from lsds.errors import CallHangs, DeviceError
from lsds.safety.deadlines import DeadlineOptions, Deadlines
from lsds.safety.device_calls import LEFT, NAME, Call, CellThread
from tests.wire.waiting import until

QUICK = Call("gripper 'acme'", "read", 0.2, "deadlines.call_s")


def named(name):
    return [thread for thread in threading.enumerate() if thread.name == name]


@pytest.fixture
def thread():
    thread = CellThread()
    yield thread
    thread.end()


@pytest.fixture
def stuck():
    """A call that returns at the end of the test only."""
    free = threading.Event()
    yield lambda: free.wait(60)
    free.set()


def test_results_errors_and_context_cross_over(thread):
    variable = contextvars.ContextVar("variable")
    variable.set("by the caller")
    assert thread.run(variable.get) == "by the caller"
    assert thread.run(threading.current_thread) is thread.run(threading.current_thread)
    with pytest.raises(KeyError):
        thread.run(lambda: {}["nothing"])
    assert thread.run(lambda: thread.run(threading.current_thread)) is thread.run(threading.current_thread)


def test_a_call_that_hangs_is_named_and_left_behind(thread, stuck):
    left = []
    with pytest.raises(CallHangs) as caught:
        thread.run(lambda: thread.calls.make(QUICK, stuck), leave=lambda: left.append(1))
    assert str(caught.value).startswith("gripper 'acme' has not returned from read() for 0.2 s")
    assert "raise deadlines.call_s" in str(caught.value)
    assert (caught.value.device, caught.value.call, caught.value.exit_code) == ("gripper 'acme'", "read", 4)
    assert isinstance(caught.value, DeviceError)
    assert left == [1]
    assert thread.run(lambda: 3) == 3, "there is a new thread"
    assert named(LEFT)


def test_an_unmarked_call_has_no_deadline(thread):
    def often():
        for _ in range(5):
            thread.calls.make(QUICK, threading.Event().wait, 0.1)

    thread.run(often)  # Longer than one call's deadline, but no call is.
    thread.run(lambda: threading.Event().wait(0.4))


def test_a_call_in_a_call_counts_for_itself(thread, stuck):
    outer = QUICK._replace(who="outer", limit_s=60.0)
    with pytest.raises(CallHangs, match="gripper 'acme'"):
        thread.run(lambda: thread.calls.make(outer, lambda: thread.calls.make(QUICK, stuck)))
    assert thread.calls.make(outer, lambda: thread.calls.at) is outer
    assert thread.calls.at is None


def test_the_thread_ends_with_its_owner():
    before = len(named(NAME))
    thread = CellThread()
    thread.run(lambda: None)
    thread.end()
    thread.end()
    assert until(lambda: len(named(NAME)) <= before)
    thread.run(lambda: None)
    del thread
    gc.collect()
    assert until(lambda: len(named(NAME)) <= before)


def test_deadlines_by_call():
    real = Deadlines(DeadlineOptions(), virtual=False)
    assert {name: real.of("arm 'a'", name).limit_s for name in ("connect", "arm", "read", "stop", "close")} == {
        "connect": 15.0,
        "arm": 20.0,
        "read": 5.0,
        "stop": 1.0,
        "close": 2.0,
    }
    assert real.of("cell 'wire'", "connect").limit_s == 60.0
    virtual = Deadlines(DeadlineOptions(), virtual=True)
    assert virtual.of("arm 'a'", "read").limit_s == 60.0
    given = Deadlines(DeadlineOptions(call_s=1.0, connect_s=2.0), virtual=True)
    assert given.of("arm 'a'", "read").limit_s == 1.0
    assert given.of("cell 'wire'", "connect").limit_s == 2.0
