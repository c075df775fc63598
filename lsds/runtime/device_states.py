"""The newest states of gripper, arm and pose source, with checks of their age."""

from __future__ import annotations

import math
from collections import deque
from numbers import Integral, Real
from typing import TYPE_CHECKING

from lsds.clock import nanoseconds
from lsds.contracts import ArmState, GripperState
from lsds.errors import PluginError, StaleData
from lsds.safety.monitors import FollowWatch, Freshness
from lsds.tactile.touch import aperture_at

if TYPE_CHECKING:
    from lsds.contracts import PoseSample, Twist
    from lsds.runtime.rig import Rig


STATES_KEPT = 128
"""States of the gripper that are remembered: a frame shows what was some of them ago."""


class States:
    """The newest state of each device, None before the first. A silent gripper or arm stops the cell."""

    def __init__(self, rig: Rig, start_ns: int) -> None:
        self.gripper: GripperState | None = None
        self.arm: ArmState | None = None
        self.pose: PoseSample | None = None
        self.pose_problem = ""
        self._rig = rig
        self._calls = rig.thread.calls
        self._reads = [rig.deadline(device, "read") for device in (rig.gripper, rig.arm, rig.pose_source)]
        self._apertures: deque[tuple[int, float]] = deque(maxlen=STATES_KEPT)
        stale = nanoseconds(rig.config.safety.stale_after_s)
        self._fresh = {
            "gripper": Freshness("gripper", start_ns, stale, remedy="check the gripper and its cable"),
            "arm": Freshness("arm", start_ns, stale, remedy="check the arm's connection"),
        }
        self._follow = FollowWatch(nanoseconds(rig.config.safety.command_lifetime_s))

    def silence_s(self, kind: str, now_ns: int) -> float:
        """Return for how long "arm" or "gripper" has sent no usable state (s), 0 within the limit."""
        return self._fresh[kind].silence_s(now_ns)

    def is_recent(self, now_ns: int) -> bool:
        """Return whether gripper and arm have sent a usable state of late: without one no grip is opened."""
        rig = self._rig
        present = [kind for kind, device in (("gripper", rig.gripper), ("arm", rig.arm)) if device is not None]
        return all(self._fresh[kind].is_recent(now_ns) for kind in present)

    def read_gripper(self, now_ns: int) -> None:
        """Read the gripper. Raises SafetyStop if it was silent for too long."""
        gripper, fresh = self._rig.gripper, self._fresh["gripper"]
        if gripper is None:
            return
        try:
            state = self._calls.expect(GripperState, self._reads[0], gripper.read)
        except StaleData as error:
            fresh.bad(str(error))
        else:
            if not isinstance(state.aperture_m, Real) or not isinstance(state.t_ns, Integral):
                problem = f"returned {state!r}, which is not a number of metres at a whole number of ns"
                raise PluginError(f"{self._reads[0].who}: read() {problem} (a mistake in that plugin)")
            if not math.isfinite(state.aperture_m):
                fresh.bad(f"its aperture is {state.aperture_m} m; a driver raises StaleData for a state it cannot read")
            elif fresh.stamped(state.t_ns, now_ns):
                self.take_gripper(state)
                fresh.good(now_ns)
        fresh.require(now_ns)

    def take_gripper(self, state: GripperState) -> None:
        """Make a state of the gripper the newest."""
        self.gripper = state
        self._apertures.append((state.t_ns, state.aperture_m))

    def aperture_at(self, t_ns: int) -> float:
        """Return the measured aperture (m) at a time, between two states by interpolation; NaN where none is known."""
        return aperture_at(self._apertures, t_ns)

    def read_arm(self, now_ns: int, wanted: Twist) -> None:
        """Read the arm, and compare its motion with the commanded velocity.

        Raises SafetyStop if it was silent, or did not follow, for too long.
        """
        arm, fresh = self._rig.arm, self._fresh["arm"]
        if arm is None:
            return
        self._follow.run(now_ns)
        try:
            state = self._calls.expect(ArmState, self._reads[1], arm.read)
        except StaleData as error:
            fresh.bad(str(error))
        else:
            if fresh.stamped(state.t_ns, now_ns):
                self.arm = state
                fresh.good(now_ns)
                self._follow.check(state, wanted, now_ns)
        fresh.require(now_ns)

    def read_pose(self, now_ns: int) -> None:
        """Read the newest poses. They serve jobs and observers only, so missing poses do not stop the cell; the reason
        is kept in `pose_problem`, "" while poses come."""
        source = self._rig.pose_source
        if source is not None:
            try:
                self.pose, self.pose_problem = self._calls.make(self._reads[2], source.read), ""
            except StaleData as error:
                self.pose, self.pose_problem = None, str(error)
