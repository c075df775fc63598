"""Checks of a device whose connection is cut. The bench's `unplug` cuts it."""

from __future__ import annotations

from typing import Any

from lsds.contracts.devices import Lifecycle
from lsds.errors import LsdsError
from lsds.testing.bench import Bench
from lsds.testing.connecting import beside, place, tolerance_m
from lsds.testing.outcomes import Needs, NotApplicable

SILENT_S = 5.0
"""Time within which `read` has to report that nothing comes any more."""


def check_unplugged_device_is_reported(bench: Bench) -> None:
    """After its connection is lost, `read` raises an LsdsError within 5 s, and stop, disarm and close raise nothing."""
    if bench.unplug is None:
        raise Needs("unplug")
    with bench.device() as device:
        bench.read(device)
        bench.unplug(device)
        reported = False
        for _ in range(50):
            bench.advance(SILENT_S / 50)
            reported = _read_fails(device) or reported
        assert reported, f"read() still returns samples {SILENT_S} s after the connection was cut; raise StaleData"
        for call in (device.stop, device.disarm, device.close):
            try:
                call()
            except Exception as error:
                raise AssertionError(
                    f"{call.__name__}() of an unplugged device raised {type(error).__name__}: {error}; do what is left "
                    "to do and return"
                ) from error


def check_unplugged_gripper_holds(bench: Bench) -> None:
    """A gripper whose connection is lost keeps its grip, and so do stop, disarm and close afterwards."""
    if bench.unplug is None:
        raise Needs("unplug")
    if not bench.may_move:
        raise Needs("motion")
    with bench.device(Lifecycle.ARMED) as gripper:
        watcher = beside(bench, gripper)
        if watcher is None:
            raise NotApplicable("nothing else shows the aperture of a real gripper that is unplugged")
        try:
            held = place(bench, watcher)[0]
            bench.unplug(gripper)
            for call in (gripper.read, gripper.stop, gripper.disarm, gripper.close):
                _try(call)
                bench.advance(0.5)
                now = place(bench, watcher)[0]
                assert now <= held + tolerance_m(watcher), (
                    f"unplugged, the gripper opened from {held} to {now} m at {call.__name__}(); "
                    "never open on a failure"
                )
        finally:
            watcher.close()


def _read_fails(device: Any) -> bool:
    try:
        device.read()
    except LsdsError:
        return True
    except Exception as error:
        raise AssertionError(
            f"read() of an unplugged device raised {type(error).__name__}: {error}; raise StaleData or ConnectionLost "
            "from it"
        ) from error
    return False


def _try(call: Any) -> None:
    try:
        call()
    except LsdsError:
        return


UNPLUGGED_CHECKS = (check_unplugged_device_is_reported,)
UNPLUGGED_GRIPPER_CHECKS = (check_unplugged_gripper_holds,)
