"""From what a script gives as a target to joint positions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lsds_mocks.wire.ur.kinematics import JOINTS
from lsds_mocks.wire.ur.motion.state import ArmMotion, Unreachable
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.script.values import Pose


def target_of(arm: ArmMotion, target: Any, near: Sequence[float]) -> list[float]:
    """Return joint positions for joint positions or for a pose. Raises ScriptError for what is neither, or no solution
    exists for."""
    if not isinstance(target, list) or len(target) != JOINTS:
        raise ScriptError(f"type_error: a pose or a list of {JOINTS} numbers is expected")
    if not isinstance(target, Pose):
        return [float(value) for value in target]
    try:
        return arm.joints(target, near)
    except Unreachable as error:
        raise ScriptError("get_inverse_kin: unable to find an inverse kinematics solution") from error
