"""Grasp by touch: no number about the object is needed.

    reference -> approach -> back off -> touch -> squeeze

The fingers close until the gel shows a touch, open a little, and close again tick by tick, which places the touch to a
fraction of a millimetre. Then they squeeze by a little. A fragile object is approached tick by tick from the start.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from lsds.clock import nanoseconds
from lsds.contracts import Contact, Grip
from lsds.errors import SafetyStop
from lsds.grip.touch import TouchFinder

if TYPE_CHECKING:
    from lsds.contracts import GripperSpec, Situation
    from lsds.task import TaskOptions

LEARNING_FRAMES = 16
"""Frames of the gel without contact that are seen before the fingers move."""
BACK_OFF_M, FARTHEST_M = 1.5e-3, 8e-3
"""How far the fingers open after the first touch, and at most, before the gel has to be free."""
FREE_FRAMES = 3
"""Frames without touch in a row that show that the gel is free."""
STIFFEST_N_M = 2000.0
"""Normal force over squeeze of a hard object (simulated: 1500 to 1900): what a fragile one may get at first."""


class TouchGrasp:
    """The stages from the reference to the first squeeze, with the parameters of the `[task]` table."""

    def __init__(self, task: TaskOptions, gripper: GripperSpec, start_ns: int) -> None:
        self._task, self._gripper = task, gripper
        self._finder = TouchFinder()
        self.stage = "reference"
        self.grip: Grip | None = None
        self.touch_m = math.nan
        self._since_ns = start_ns
        self._stepped_ns = start_ns
        self._opened_m = 0.0
        self._free = 0
        self._frames = 0

    def step(self, now: Situation) -> bool:
        """Advance; return whether the object is grasped. Raises SafetyStop where it cannot be, with the reason."""
        new = self._sees(now)
        stage = self.stage
        self._require_time(now)
        if stage == "reference":
            if now.referenced and self._finder.frames >= LEARNING_FRAMES and now.gripper is not None:
                self._begin(now)
        elif stage == "approach":
            self._approach(now)
        elif stage == "back off":
            self._back_off(now, new)
        elif stage == "touch":
            self._close_by_ticks(now)
        elif now.arrived:
            return self._is_held(now)
        return False

    def _sees(self, now: Situation) -> bool:
        self._finder.see(now)
        new, self._frames = self._finder.frames > self._frames, self._finder.frames
        return new

    def _begin(self, now: Situation) -> None:
        if self._finder.touching:
            raise SafetyStop("task: something touches the gel before the fingers close (clear the pads)")
        if self._task.fragile_n is not None:
            self._enter("touch", now)
            return
        self._enter("approach", now, self._grip(0.0, self._task.approach_speed_m_s))

    def _approach(self, now: Situation) -> None:
        if self._finder.touching:
            self._opened_m = BACK_OFF_M
            top_m = self._finder.touch_m + self._finder.std_m * math.sqrt(3)
            self._enter("back off", now, self._grip(top_m + self._opened_m, self._task.approach_speed_m_s))
        else:
            self._require_something(now)

    def _back_off(self, now: Situation, new: bool) -> None:
        """Wait until the gel is free again; open farther where it is not."""
        if not now.arrived:
            return
        if new:
            self._free = 0 if self._finder.touching else self._free + 1
            if self._finder.touching and self.grip is not None:
                self._opened_m += BACK_OFF_M
                if self._opened_m > FARTHEST_M:
                    raise SafetyStop(
                        f"task: the gel still shows a touch after the fingers opened by {self._opened_m * 1e3:.0f} mm "
                        "(does the object stick to it? clean the pads)"
                    )
                self.grip = self._grip(self.grip.aperture_m + BACK_OFF_M, self._task.approach_speed_m_s)
        if self._free >= FREE_FRAMES:
            self._finder.again()
            self._enter("touch", now)

    def _close_by_ticks(self, now: Situation) -> None:
        if self._finder.touching:
            self.touch_m = self._finder.touch_m
            # At the speed that corrections will have, too.
            self._enter("squeeze", now, self._grip(self.touch_m - self._squeeze_m(), self._task.grip_speed_m_s))
            return
        self._require_something(now)
        tick_m = self._gripper.resolution_m
        if now.gripper is not None and now.t_ns - self._stepped_ns >= nanoseconds(tick_m / self._task.touch_speed_m_s):
            self._stepped_ns = now.t_ns
            last_m = now.gripper.aperture_m if self.grip is None else self.grip.aperture_m
            self.grip = self._grip(last_m - tick_m, self._task.touch_speed_m_s)

    def _is_held(self, now: Situation) -> bool:
        """Tell whether every finger has touched; while the squeeze settles they may differ a little."""
        untouched = self._finder.untouched
        if untouched:
            raise SafetyStop(
                f"task: finger {', '.join(untouched)} does not touch the object, the others do "
                "(is it between the pads?)"
            )
        self.touch_m = self._finder.touch_m
        return True

    def _squeeze_m(self) -> float:
        task = self._task
        allowed = math.inf if task.fragile_n is None else task.fragile_n / STIFFEST_N_M
        return min(task.first_squeeze_m, allowed)

    def _grip(self, aperture_m: float, speed_m_s: float) -> Grip:
        return Grip(min(max(aperture_m, 0.0), self._gripper.stroke_m), speed_m_s, self._task.grip_force_n)

    def _enter(self, stage: str, now: Situation, grip: Grip | None = None) -> None:
        self.stage, self._since_ns = stage, now.t_ns
        self.grip = grip if grip is not None else self.grip

    def _require_something(self, now: Situation) -> None:
        """Raise SafetyStop where the fingers have come to the end without a touch."""
        state = now.gripper
        if state is None or state.moving:
            return
        if state.contact is Contact.CLOSING:
            raise SafetyStop(
                f"task: the fingers stopped at {state.aperture_m * 1e3:.1f} mm on something that the gel does not feel "
                "(does it touch beside the pads?)"
            )
        if now.arrived and state.aperture_m <= 2 * self._gripper.resolution_m:
            raise SafetyStop("task: nothing there: the fingers have closed without a touch")

    def _require_time(self, now: Situation) -> None:
        # Ticks take the time that the whole stroke takes; everything else is a matter of seconds.
        limit_s = self._task.timeout_s
        if self.stage == "touch":
            limit_s += self._gripper.stroke_m / self._task.touch_speed_m_s
        elif self.stage == "approach":
            limit_s += self._gripper.stroke_m / self._task.approach_speed_m_s
        if now.t_ns - self._since_ns > nanoseconds(limit_s):
            raise SafetyStop(
                f"task: nothing was grasped: stage '{self.stage}' took longer than {limit_s:.0f} s "
                "(does the gripper follow? raise task.timeout_s if that is normal)"
            )
