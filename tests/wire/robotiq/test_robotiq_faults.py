"""Every driver under every fault of the wire: in time, in words, never opening, nothing left behind."""

from __future__ import annotations

import threading

import pytest

from lsds.errors import ConnectFailed, DeviceError, DeviceFault, StaleData
from tests.wire.robotiq.rig import (
    CLOCK,
    FACES,
    build,
    nothing_left,
    options_for,
    serving,
    to,
    until,
)

PATIENCE = {"answer_timeout_ms": 60.0, "stale_after_ms": 150.0, "reconnect_after_s": 0.2}
CALL_S = 1.5
"""The longest that a call may take which does no I/O or is bounded; generous, for a busy machine."""
OVER = {
    "hand-e": (
        "drop",
        "drop-half",
        "delay",
        "corrupt",
        "corrupt-half",
        "crc",
        "truncate",
        "split",
        "duplicate",
        "wrong-slave",
        "freeze",
        "disconnect",
        "busy",
    ),
    "hand-e-tcp": ("drop", "delay", "truncate", "split", "duplicate", "disconnect", "busy"),
    "hand-e-urcap": (
        "drop",
        "drop-half",
        "delay",
        "corrupt",
        "corrupt-half",
        "truncate",
        "split",
        "duplicate",
        "freeze",
        "disconnect",
        "busy",
    ),
}
"""Faults tested on each transport. Frames are the same on a serial port and on TCP, so damaged frames are tested on the
port only; `robotiq-2f` differs from `hand-e` in its figures only."""
FAULTS = {
    "drop": {},
    "drop-half": {"kind": "drop", "probability": 0.5},
    "delay": {"delay_ms": 100},
    "corrupt": {},
    "corrupt-half": {"kind": "corrupt", "probability": 0.5},
    "crc": {},
    "truncate": {},
    "split": {"delay_ms": 30},
    "duplicate": {},
    "wrong-slave": {},
    "freeze": {},
    "disconnect": {},
    "busy": {},
}
CASES = [pytest.param(driver, fault, id=f"{driver}-{fault}") for driver, faults in OVER.items() for fault in faults]


@pytest.fixture(scope="module")
def mock(tmp_path_factory):
    with serving(tmp_path_factory.mktemp("hand"), activated=True, activation_s=0.2) as mock:
        yield mock
        assert mock.complaints == ""


def timed(call, *arguments):
    """Return the result of a call or its DeviceError; fail if it takes too long or raises another exception."""
    began = CLOCK.now()
    try:
        result = call(*arguments)
    except DeviceError as error:
        result = error
    assert CLOCK.now() - began < CALL_S * 1e9, f"{call.__name__} took {(CLOCK.now() - began) * 1e-9:.2f} s"
    assert not isinstance(result, DeviceError) or result.remedy, f"no remedy: {result}"
    return result


def aperture(gripper):
    state = timed(gripper.read)
    return None if isinstance(state, DeviceError) else state.aperture_m


def close_to(gripper, aperture_m):
    """Command until it is there; whether it came there."""

    def there():
        timed(gripper.command, to(aperture_m))
        found = aperture(gripper)
        return found is not None and abs(found - aperture_m) < 5e-4

    return until(there, 8)


@pytest.mark.parametrize(("driver", "fault"), CASES)
def test_under_a_fault(mock, driver, fault):
    with nothing_left():
        gripper = build(driver, options_for(driver, mock) | PATIENCE)
        gripper.connect()
        gripper.arm()
        assert close_to(gripper, 0.02)

        spec = {"kind": fault, "face": FACES[driver], "for_s": 0.2, **FAULTS[fault]}
        if fault == "freeze":
            del spec["face"]
        mock.inject(**spec)
        widest, believable = 0.0, not (driver == "hand-e-urcap" and "corrupt" in fault)  # Strings have no CRC.
        ends = CLOCK.now() + 280_000_000
        while CLOCK.now() < ends:
            timed(gripper.command, to(0.02))
            widest = max(widest, (aperture(gripper) or 0.0) * believable)
            CLOCK.sleep_until(CLOCK.now() + 10_000_000)
        timed(gripper.stop)
        timed(gripper.stop)
        assert until(lambda: aperture(gripper) is not None), "it did not come back"
        assert max(widest, aperture(gripper)) < 0.021, "it opened"
        assert close_to(gripper, 0.015), "it does not obey any more"
        timed(gripper.disarm)
        timed(gripper.close)
    assert close_again(driver, mock) < 0.0155, "it opened when it was closed"


def close_again(driver, mock):
    """Where a fresh driver finds the fingers."""
    gripper = build(driver, options_for(driver, mock))
    gripper.connect()
    found = gripper.read().aperture_m
    gripper.close()
    return found


@pytest.mark.parametrize("driver", ["hand-e", "hand-e-tcp", "hand-e-urcap"])
@pytest.mark.parametrize("fault", ["drop", "truncate", "disconnect"])
def test_ending_it_in_the_middle_of_a_fault(mock, driver, fault):
    with nothing_left():
        gripper = build(driver, options_for(driver, mock) | PATIENCE)
        gripper.connect()
        gripper.arm()
        assert close_to(gripper, 0.02)
        mock.inject(fault, face=FACES[driver], for_s=0.25)
        CLOCK.sleep_until(CLOCK.now() + 50_000_000)
        stops = [threading.Thread(target=gripper.stop) for _ in range(2)]
        for thread in stops:
            thread.start()
        for thread in stops:
            thread.join(2)
            assert not thread.is_alive()
        began = CLOCK.now()
        gripper.close()
        assert CLOCK.now() - began < 4e9
    assert until(lambda: comes_back(driver, mock))
    assert close_again(driver, mock) < 0.021


def comes_back(driver, mock):
    try:
        close_again(driver, mock)
    except DeviceError:
        return False
    return True


@pytest.mark.parametrize(
    ("driver", "fault"),
    [
        *((driver, "wrong-slave") for driver in ("hand-e", "hand-e-tcp")),
        *((d, f) for d in ("hand-e", "hand-e-tcp", "hand-e-urcap") for f in ("drop", "truncate", "disconnect", "busy")),
    ],
)
def test_connecting_to_what_does_not_answer(mock, driver, fault):
    with nothing_left():
        mock.inject(fault, face=FACES[driver], for_s=0.35)
        CLOCK.sleep_until(CLOCK.now() + 20_000_000)
        gripper = build(driver, options_for(driver, mock) | PATIENCE | {"connect_timeout_s": 0.15})
        began = CLOCK.now()
        with pytest.raises(ConnectFailed) as raised:
            gripper.connect()
        assert CLOCK.now() - began < CALL_S * 1e9
        assert raised.value.remedy
        assert gripper.lifecycle.value == "new"
        gripper.close()
    assert until(lambda: comes_back(driver, mock))


@pytest.mark.parametrize(
    ("driver", "code"),
    [
        *(("hand-e", code) for code in (0x08, 0x0A, 0x0B, 0x0C, 0x0D, 0x0E, 0x0F, 0x2E)),
        *(("hand-e-urcap", code) for code in (0x08, 0x0B, 0x2E)),
    ],
)
def test_the_grippers_own_faults(mock, driver, code):
    with nothing_left():
        gripper = build(driver, options_for(driver, mock) | PATIENCE)
        gripper.connect()
        gripper.arm()
        assert close_to(gripper, 0.02)
        mock.inject("gripper-fault", code=code, count=1)
        assert until(lambda: isinstance(timed(gripper.read), DeviceFault))
        fault = timed(gripper.read)
        if code in (0x0B, 0x0F):
            assert fault.code in ("0x0B", "0x0F")
        else:
            assert fault.code == f"0x{code & 0x0F:02X}"
        assert isinstance(timed(gripper.command, to(0.05)), DeviceFault)
        gripper.disarm()
        if code == 0x08:
            assert until(lambda: aperture(gripper) is not None), "it does not cool down"
        gripper.arm()
        assert close_to(gripper, 0.02)
        gripper.close()


@pytest.mark.parametrize("code", [0x05, 0x09])
def test_faults_that_pass_are_not_raised(mock, code):
    gripper = build("hand-e", options_for("hand-e", mock))
    gripper.connect()
    gripper.arm()
    mock.inject("gripper-fault", code=code, count=1)
    for _ in range(10):
        gripper.read()
        CLOCK.sleep_until(CLOCK.now() + 20_000_000)
    gripper.close()


def test_activation_over_a_bad_line(tmp_path):
    faults = [{"kind": kind, "probability": 0.15} for kind in ("drop", "crc", "truncate", "duplicate")]
    with nothing_left(), serving(tmp_path, activation_s=0.4, faults=faults) as mock:
        gripper = build("hand-e", options_for("hand-e", mock) | PATIENCE | {"stale_after_ms": 1000.0})
        gripper.connect()
        gripper.arm()
        assert close_to(gripper, 0.01)
        assert gripper.counts.timeouts + gripper.counts.damaged > 0
        gripper.close()


def test_a_failed_activation_reports_the_grippers_code(tmp_path):
    with serving(tmp_path, object_mm=30, object_stays=True) as mock:
        gripper = build("hand-e", options_for("hand-e", mock))
        gripper.connect()
        with pytest.raises(DeviceFault, match="take away what is between") as raised:
            gripper.arm()
        assert raised.value.code == "0x0D"
        assert gripper.lifecycle.value == "connected"
        gripper.close()


def test_late_answers_are_not_taken_for_the_next_ones(mock):
    """Answers that come one request late would show the fingers where they were a request ago."""
    gripper = build("hand-e-tcp", options_for("hand-e-tcp", mock) | {"answer_timeout_ms": 40.0, "poll_hz": 20.0})
    gripper.connect()
    mock.inject("delay", face="tcp", delay_ms=55.0, for_s=0.5)
    before = gripper.counts.damaged + gripper.counts.timeouts
    assert until(lambda: isinstance(timed(gripper.read), StaleData))
    assert gripper.counts.damaged + gripper.counts.timeouts > before
    assert until(lambda: aperture(gripper) is not None)
    gripper.close()
