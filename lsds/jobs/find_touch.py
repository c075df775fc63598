"""Grasp by touch: no number about the object is needed.

    reference -> approach -> back off -> touch -> squeeze

The fingers close until the gel shows a touch, open a little, and close again tick by tick, which places the touch to a
fraction of a millimetre. Then they squeeze by a little. A fragile object is approached tick by tick from the start.
Until the squeeze the gripper pushes with its least force, and the fingers go on only while every camera shows something
new: what touch rests on must not fail unseen.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from lsds.clock import nanoseconds
from lsds.contracts import Contact, Grip
from lsds.errors import SafetyStop
from lsds.grip.fragile import HARDEST_OBJECT_N_M, allowed_squeeze_m
from lsds.tactile.contact_place import edge_of
from lsds.tactile.touch import PAIRED_FRAMES, TouchFinder

if TYPE_CHECKING:
    from lsds.contracts import GripperSpec, Setting, Situation
    from lsds.contracts.task import TaskOptions

LEARNING_FRAMES = 16
"""Number of frames of the gel without contact before the fingers move; chosen."""
BACK_OFF_M = 1.5e-3
"""Opening of the fingers after the first touch, m; chosen."""
MOST_BACK_OFF_M = 8e-3
"""Maximum opening of the fingers before the gel must be free, m; chosen."""
FREE_FRAMES = PAIRED_FRAMES
"""Frames without touch in a row that show that the gel is free: those of pairs without an earlier frame."""
FIRST_SHARE = 0.8
"""Share of the limit of a fragile object that the first squeeze uses; chosen."""
ARRIVED_TICKS = 0.75
"""Maximum distance of fingers that have arrived from the commanded aperture, ticks; chosen below 1, because a slow
gripper rests one tick away before it starts."""
BLIND_WAIT_S = 0.15
"""Time without a new frame of every finger after which the fingers wait, s; chosen."""
BLIND_STOP_S = 1.0
"""Time without a new frame of every finger after which the cell stops, s; chosen."""


class TouchGrasp:
    """The stages from the reference to the first squeeze, with the parameters of the `[task]` table."""

    def __init__(self, task: TaskOptions, gripper: GripperSpec, setting: Setting) -> None:
        self._task, self._gripper = task, gripper
        self._finder = TouchFinder(setting.fingers, setting.t_ns)
        least_m, most_m = setting.apertures_m
        self._least_m, self._most_m = max(least_m, 0.0), min(most_m, gripper.stroke_m)
        self.stage = "reference"
        self.grip: Grip | None = None
        self.touch_m = math.nan
        self._since_ns = setting.t_ns
        self._stepped_ns = setting.t_ns
        self._settled_ns: int | None = None
        self._stopped_ns: int | None = None
        self._opened_m = 0.0
        self._free = 0
        self._frames = 0
        # Edges at which the gel shows a depth without contact, as a worn marker at the image's border may.
        self._false_edges: set[tuple[str, str]] = set()

    @property
    def touch_std_m(self) -> float:
        """Standard deviation of `touch_m`, m: the touch lies between two frames."""
        return self._finder.std_m

    def step(self, now: Situation) -> bool:
        """Advance; return whether the object is grasped. Raises SafetyStop where it cannot be, with the reason."""
        self._finder.see(now)
        new, self._frames = self._finder.frames > self._frames, self._finder.frames
        self._require_time(now)
        if not self._finder.touching:
            self._false_edges.update((finger.finger, edge_of(finger.observation.contact)) for finger in now.fingers)
        if self.stage == "reference":
            if now.referenced and self._frames >= LEARNING_FRAMES and now.gripper is not None:
                self._begin(now)
        elif self.stage == "approach":
            self._approach(now)
        elif self.stage == "back off":
            self._back_off(now, new)
        elif self.stage == "touch":
            self._close_by_ticks(now, new)
        else:
            return self._is_held(now)
        return False

    def _begin(self, now: Situation) -> None:
        if self._finder.touching:
            raise SafetyStop("task: something touches the gel before the fingers close (clear the pads)")
        if self._task.fragile_n is not None:
            self._enter("touch", now)
            return
        self._enter("approach", now, self._gently(self._least_m, self._task.approach_speed_m_s))

    def _approach(self, now: Situation) -> None:
        if self._finder.touching:
            self._opened_m = BACK_OFF_M
            top_m = self._finder.touch_m + self._finder.std_m * math.sqrt(3)
            self._enter("back off", now, self._gently(top_m + self._opened_m, self._task.approach_speed_m_s))
        elif self._is_blind(now):
            if self.grip is not None and self.grip.aperture_m == self._least_m and now.gripper is not None:
                self.grip = self._gently(now.gripper.aperture_m, self._task.approach_speed_m_s)
        else:
            self.grip = self._gently(self._least_m, self._task.approach_speed_m_s)
            self._require_something(now)

    def _back_off(self, now: Situation, new: bool) -> None:
        """Wait until the gel is free again; open farther where it is not."""
        if not now.arrived:
            self._finder.forget()
            return
        if new:
            self._free = 0 if self._finder.touching else self._free + 1
            if self._finder.touching and self.grip is not None:
                self._opened_m += BACK_OFF_M
                if self._opened_m > MOST_BACK_OFF_M:
                    raise SafetyStop(
                        f"task: the gel still shows a touch after the fingers opened by {self._opened_m * 1e3:.0f} mm "
                        "(does the object stick to it? does the light change? clean the pads, shield the gel)"
                    )
                self.grip = self._gently(self.grip.aperture_m + BACK_OFF_M, self._task.approach_speed_m_s)
                self._finder.forget()
        if self._free >= FREE_FRAMES:
            self._finder.again()
            self._enter("touch", now)

    def _close_by_ticks(self, now: Situation, new: bool) -> None:
        if self._finder.touching:
            self._squeeze(now)
        elif not self._is_blind(now) and self._may_step(now, new):
            self._require_something(now)
            # Every step is progress: only one that does not come is late.
            self._stepped_ns = self._since_ns = now.t_ns
            self._settled_ns = None
            self.grip = self._gently(self._last_m(now) - self._gripper.resolution_m, self._task.touch_speed_m_s)

    def _may_step(self, now: Situation, new: bool) -> bool:
        """Tell whether the next tick may come: in time, and with the gel seen since the last one.

        For a fragile object the fingers must have come to rest before the frames that show no touch.
        """
        tick_m = self._gripper.resolution_m
        if now.gripper is None or now.t_ns - self._stepped_ns < nanoseconds(tick_m / self._task.touch_speed_m_s):
            return False
        if self._task.fragile_n is None or self.grip is None:
            return new
        state = now.gripper
        if (
            state.t_ns <= self._stepped_ns
            or state.moving
            or abs(state.aperture_m - self._last_m(now)) > ARRIVED_TICKS * tick_m
        ):
            return False
        self._settled_ns = state.t_ns if self._settled_ns is None else self._settled_ns
        return self._finder.seen_ns > self._settled_ns

    def _squeeze(self, now: Situation) -> None:
        self.touch_m = self._finder.touch_m
        squeezed_m = self.touch_m - self._squeeze_m()
        if squeezed_m < self._least_m - self._gripper.resolution_m:
            raise SafetyStop(
                f"task: the object was touched at {self.touch_m * 1e3:.1f} mm, and a first squeeze of "
                f"{self._squeeze_m() * 1e3:.1f} mm needs less than safety.min_aperture_m allows (lower one of them)"
            )
        # At the speed and force that corrections will have, too; ticks under way are not taken back.
        aperture_m = min(squeezed_m, self._last_m(now))
        self._settled_ns = None
        self._enter("squeeze", now, self._grip(aperture_m, self._task.grip_speed_m_s, self._task.grip_force_n))

    def _is_held(self, now: Situation) -> bool:
        """Tell whether every finger touches in a frame of after the squeeze; a false alarm goes on closing."""
        if not now.arrived or now.gripper is None:
            return False
        self._settled_ns = now.gripper.t_ns if self._settled_ns is None else self._settled_ns
        if self._finder.seen_ns <= self._settled_ns:
            return False
        apart = self._finder.apart
        if apart and not self._finder.touching:
            # It was the light that changed: nothing is between the fingers yet.
            self._finder.again()
            self.touch_m = math.nan
            self._enter("touch", now)
            return False
        if apart:
            raise SafetyStop(
                f"task: finger {', '.join(apart)} does not touch the object, the others do (is it between the pads?)"
            )
        for finger in now.fingers:
            edge = edge_of(finger.observation.contact)
            if edge and (finger.finger, edge) not in self._false_edges:
                raise SafetyStop(
                    f"task: finger {finger.finger} touches the object at the {edge} edge of its pad only "
                    "(move the gripper so that the pads' centres meet it)"
                )
        self.touch_m = self._finder.touch_m
        squeezed_m = self.touch_m - self._squeeze_m()
        if self._task.fragile_n is None and squeezed_m < self._last_m(now) - self._gripper.resolution_m:
            # The first touch was a mistake, and the fingers have touched later than they were squeezed for.
            self._squeeze(now)
            return False
        return not self._squeezes_on(now)

    def _squeezes_on(self, now: Situation) -> bool:
        """Squeeze a fragile object on, up to the first squeeze, as far as its imprint shows that it withstands it."""
        if self._task.fragile_n is None or self.grip is None or now.gripper is None:
            return False
        loads = [finger.observation.load for finger in now.fingers]
        forces_n = [load.normal_n for load in loads if load is not None and math.isfinite(load.normal_n)]
        if not forces_n:
            return False
        normal_n = max(forces_n)
        squeeze_m = max(self.touch_m - now.gripper.aperture_m, 0.0)
        allowed_m = FIRST_SHARE * allowed_squeeze_m(self._task.fragile_n, squeeze_m, normal_n)
        aperture_m = self.touch_m - min(allowed_m, self._task.first_squeeze_m)
        if aperture_m > self.grip.aperture_m - self._gripper.resolution_m:
            return False
        self._settled_ns = None
        self.grip = self._grip(aperture_m, self._task.grip_speed_m_s, self._task.grip_force_n)
        return True

    def _last_m(self, now: Situation) -> float:
        """Return the aperture asked for last, m."""
        if self.grip is not None:
            return self.grip.aperture_m
        return self._most_m if now.gripper is None else now.gripper.aperture_m

    def _squeeze_m(self) -> float:
        task = self._task
        allowed = math.inf if task.fragile_n is None else FIRST_SHARE * task.fragile_n / HARDEST_OBJECT_N_M
        return min(task.first_squeeze_m, allowed)

    def _gently(self, aperture_m: float, speed_m_s: float) -> Grip:
        """Return a grip with the least force: nothing is to be held yet."""
        return self._grip(aperture_m, speed_m_s, min(self._gripper.force_n[0], self._task.grip_force_n))

    def _grip(self, aperture_m: float, speed_m_s: float, force_n: float) -> Grip:
        return Grip(min(max(aperture_m, self._least_m), self._most_m), speed_m_s, force_n)

    def _enter(self, stage: str, now: Situation, grip: Grip | None = None) -> None:
        self.stage, self._since_ns, self._stopped_ns = stage, now.t_ns, None
        self.grip = grip if grip is not None else self.grip

    def _is_blind(self, now: Situation) -> bool:
        """Tell whether a finger shows nothing new. Raises SafetyStop where that lasts."""
        silent_s, name = self._finder.silent_s(now.t_ns)
        if silent_s > BLIND_STOP_S:
            raise SafetyStop(
                f"task: finger {name} has shown nothing new for {silent_s:.1f} s while the fingers close "
                "(check its camera)"
            )
        return silent_s > BLIND_WAIT_S

    def _require_something(self, now: Situation) -> None:
        """Raise SafetyStop where the fingers have come to the end without a touch."""
        state = now.gripper
        if state is None or state.moving or state.contact is not Contact.CLOSING:
            self._stopped_ns = None
        if state is None or state.moving:
            return
        if state.contact is Contact.CLOSING:
            self._stopped_ns = state.t_ns if self._stopped_ns is None else self._stopped_ns
            # A fast gripper with a low force stops before the frame that shows the touch has arrived.
            if self._finder.seen_ns <= self._stopped_ns:
                return
            raise SafetyStop(
                f"task: the fingers stopped at {state.aperture_m * 1e3:.1f} mm on something that the gel does not feel "
                "(does it touch outside of the pads?)"
            )
        if now.arrived and state.aperture_m <= self._least_m + 2 * self._gripper.resolution_m:
            where = f" to {self._least_m * 1e3:.1f} mm, as far as they may," if self._least_m > 0 else ""
            raise SafetyStop(f"task: nothing there: the fingers have closed{where} without a touch")

    def _require_time(self, now: Situation) -> None:
        # The approach takes the time that the whole stroke takes; everything else is a matter of seconds.
        limit_s = self._task.timeout_s
        if self.stage == "approach":
            limit_s += self._gripper.stroke_m / self._task.approach_speed_m_s
        if now.t_ns - self._since_ns > nanoseconds(limit_s):
            raise SafetyStop(
                f"task: nothing was grasped: stage '{self.stage}' took longer than {limit_s:.0f} s "
                "(does the gripper follow? raise task.timeout_s if that is normal)"
            )
