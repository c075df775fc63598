"""Checks of a script's numeric arguments, and conversion of a target to joint positions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lsds_mocks.wire.ur.kinematics import JOINTS
from lsds_mocks.wire.ur.motion.state import ArmMotion, Unreachable
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.script.values import Pose

LARGEST_MAGNITUDE = 1e9
"""Largest magnitude of a position, speed or force; larger, infinite and NaN values are refused."""


def numbers(values: Any, count: int = JOINTS) -> list[float]:
    """Return a list's numbers. Raises ScriptError if their count is not `count` or one is not finite."""
    if not isinstance(values, list) or len(values) != count:
        raise ScriptError(f"type_error: a list of {count} numbers is expected")
    found = [float(value) for value in values]
    if not all(abs(value) < LARGEST_MAGNITUDE for value in found):
        raise ScriptError(f"value_error: {found} are not finite numbers")
    return found


def positive(value: Any, name: str) -> float:
    """Return a number. Raises ScriptError if it is not finite and above zero."""
    number = float(value)
    if not 0 < number < LARGEST_MAGNITUDE:
        raise ScriptError(f"value_error: {name} is {number:g}, it has to be above zero")
    return number


def not_negative(value: Any, name: str) -> float:
    """Return a number. Raises ScriptError if it is not finite or below zero."""
    number = float(value)
    if not 0 <= number < LARGEST_MAGNITUDE:
        raise ScriptError(f"value_error: {name} is {number:g}, it must not be negative")
    return number


def target_of(arm: ArmMotion, target: Any, near: Sequence[float]) -> list[float]:
    """Return the joint positions of a target, given as joint positions or a pose.

    Raises ScriptError for any other value, or if there is no solution.
    """
    wanted = numbers(target)
    if not isinstance(target, Pose):
        return wanted
    try:
        return arm.joints(wanted, near)
    except Unreachable as error:
        raise ScriptError("get_inverse_kin: unable to find an inverse kinematics solution") from error
