"""The checks of each kind, those that move a device, and the sections of the guide that explain them."""

from __future__ import annotations

from collections.abc import Callable

from lsds.contracts.kinds import Kind
from lsds.testing.algorithms import ALGORITHM_CHECKS
from lsds.testing.arm_state import ARM_STATE_CHECKS, POSE_CHECKS
from lsds.testing.bench import Bench
from lsds.testing.commands import COMMAND_CHECKS
from lsds.testing.connecting import CONNECTING_CHECKS
from lsds.testing.corrections import CONTROLLER_CHECKS
from lsds.testing.fault_traces import FAULT_TRACE_CHECKS
from lsds.testing.faults import FAULT_CHECKS
from lsds.testing.gripper_state import GRIPPER_STATE_CHECKS
from lsds.testing.latency import LATENCY_CHECKS
from lsds.testing.leaks import LEAK_CHECKS
from lsds.testing.lifecycle import LIFECYCLE_CHECKS
from lsds.testing.machine import check_any_order_of_calls
from lsds.testing.motion import ARM_CHECKS, GRIPPER_CHECKS
from lsds.testing.option_keys import OPTION_CHECKS
from lsds.testing.pictures import PICTURE_CHECKS
from lsds.testing.sensing import SENSOR_CHECKS
from lsds.testing.slip_answers import DETECTOR_CHECKS, ESTIMATOR_CHECKS
from lsds.testing.specs import SPEC_CHECKS
from lsds.testing.stamps import STAMP_CHECKS
from lsds.testing.studies import STUDY_CHECKS
from lsds.testing.tracks import TRACKER_CHECKS
from lsds.testing.unplugged import UNPLUGGED_CHECKS, UNPLUGGED_GRIPPER_CHECKS
from lsds.testing.wire_mocks import WIRE_MOCK_CHECKS
from lsds.testing.wishes import JOB_CHECKS

Check = Callable[[Bench], None]

GUIDE = "docs/plugins.md"
MOVING: frozenset[Check] = frozenset({*GRIPPER_CHECKS, *ARM_CHECKS})
"""Checks that do nothing but move the device. Others need permission for a part, or ask for it themselves."""
_EVERY_DEVICE = (*LIFECYCLE_CHECKS, *LEAK_CHECKS, *LATENCY_CHECKS, *STAMP_CHECKS, *UNPLUGGED_CHECKS)
_DEVICE_CHECKS: dict[Kind, tuple[Check, ...]] = {
    "sensor": (*SPEC_CHECKS, *SENSOR_CHECKS, *PICTURE_CHECKS),
    "gripper": (
        *SPEC_CHECKS,
        *CONNECTING_CHECKS,
        *GRIPPER_STATE_CHECKS,
        *GRIPPER_CHECKS,
        *UNPLUGGED_GRIPPER_CHECKS,
    ),
    "arm": (*SPEC_CHECKS, *CONNECTING_CHECKS, *ARM_STATE_CHECKS, *ARM_CHECKS),
    "pose_source": POSE_CHECKS,
}
_OTHER_CHECKS: dict[Kind, tuple[Check, ...]] = {
    "fault": (*FAULT_CHECKS, *FAULT_TRACE_CHECKS),
    "wire_mock": WIRE_MOCK_CHECKS,
    "study": STUDY_CHECKS,
    "command": COMMAND_CHECKS,
}
_ALGORITHM_CHECKS: dict[Kind, tuple[Check, ...]] = {
    "tracker": TRACKER_CHECKS,
    "detector": DETECTOR_CHECKS,
    "estimator": ESTIMATOR_CHECKS,
    "controller": CONTROLLER_CHECKS,
    "job": JOB_CHECKS,
}
CHECKED_KINDS: tuple[Kind, ...] = (*_DEVICE_CHECKS, *_ALGORITHM_CHECKS, *_OTHER_CHECKS)
"""Kinds that have checks."""
_PLURALS: dict[Kind, str] = {"study": "studies"}
_SECTIONS: dict[tuple[Check, ...], str] = {
    (*LIFECYCLE_CHECKS, *LEAK_CHECKS, *LATENCY_CHECKS, *UNPLUGGED_CHECKS, check_any_order_of_calls): "life-cycle",
    STAMP_CHECKS: "samples",
    ALGORITHM_CHECKS: "every-algorithm",
    OPTION_CHECKS: "options",
}


def checks_of(kind: Kind) -> tuple[Check, ...]:
    """Return the checks of a kind. Raises ValueError for a kind without checks."""
    if kind in _ALGORITHM_CHECKS:
        return (*OPTION_CHECKS, *ALGORITHM_CHECKS, *_ALGORITHM_CHECKS[kind])
    if kind in _OTHER_CHECKS:
        return (*OPTION_CHECKS, *_OTHER_CHECKS[kind])
    if kind not in _DEVICE_CHECKS:
        raise ValueError(f"there are no conformance checks for a {kind}; kinds with checks: {', '.join(CHECKED_KINDS)}")
    return (*OPTION_CHECKS, *_EVERY_DEVICE, *_DEVICE_CHECKS[kind], check_any_order_of_calls)


def name_of(check: Check) -> str:
    """Return the name of a check, without "check_"."""
    return check.__name__.removeprefix("check_")


def rule_of(check: Check) -> str:
    """Return the promise that a check tests, on one line."""
    return " ".join((check.__doc__ or "").split("\n\n")[0].split())


def guide_of(kind: Kind, check: Check) -> str:
    """Return the section of the guide about a check."""
    own = _PLURALS.get(kind, kind.replace("_", "-") + "s")
    return f"{GUIDE}#{next((section for checks, section in _SECTIONS.items() if check in checks), own)}"
