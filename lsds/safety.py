"""Limits and the watchdog: an aid that keeps mistakes small. It is not a safety function.

Nothing here is certified or redundant, and all of it runs on the computer that it guards. People are protected by the
emergency stop, the arm's own safety configuration and the layout of the cell, never by this module.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace

from pydantic import BaseModel, ConfigDict, Field

from lsds.clock import nanoseconds, seconds
from lsds.contracts.values import ArmCommand, GripperCommand, Twist
from lsds.errors import LimitExceeded, SafetyStop


class SafetyOptions(BaseModel):
    """Options of the `[safety]` table: limits of the cell, over and above those of each device."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    max_grip_force_n: float = Field(default=100.0, gt=0, le=500, description="most that the gripper may push with")
    max_finger_speed_m_s: float = Field(default=0.15, gt=0, le=1, description="fastest closing or opening")
    max_arm_speed_m_s: float = Field(default=0.1, gt=0, le=2, description="fastest linear TCP velocity")
    max_arm_angular_rad_s: float = Field(default=0.5, gt=0, le=10, description="fastest TCP rotation")
    max_arm_acceleration_m_s2: float = Field(default=1.0, gt=0, le=20, description="hardest TCP acceleration")
    min_aperture_m: float = Field(default=0.0, ge=0, le=0.5, description="never close further than this")
    max_aperture_m: float | None = Field(default=None, gt=0, le=0.5, description="never open further than this")
    stale_after_s: float = Field(default=0.2, gt=0, le=10, description="stop where no new frame came for so long")
    frozen_after_s: float = Field(
        default=1.0, gt=0, le=3600, description="stop where the camera repeats one image for so long"
    )
    watchdog_s: float = Field(default=0.5, gt=0, le=10, description="stop where the loop is silent for so long")
    command_lifetime_s: float = Field(default=0.1, gt=0, le=10, description="a motion command expires after so long")


@dataclass(slots=True)
class GuardCounts:
    """How often each limit changed a command."""

    force: int = 0
    finger_speed: int = 0
    aperture: int = 0
    kept_closed: int = 0
    arm_speed: int = 0
    arm_angular: int = 0
    arm_acceleration: int = 0


class Guard:
    """Keeps commands within the cell's limits: clamps and counts; refuses what is not a number."""

    def __init__(self, options: SafetyOptions) -> None:
        self._options = options
        self.counts = GuardCounts()

    def gripper(self, command: GripperCommand, held_aperture_m: float, *, allow_opening: bool) -> GripperCommand:
        """Return the command within the limits.

        `held_aperture_m` is what the gripper was last really sent, so what it holds the object with. An automatic
        grip correction passes `allow_opening=False` and can then only close: a sign error or a bad estimate in the
        chain must not let go of the object. A release asked for by the task, and the demonstration of the paper's
        literal sign, pass True. Raises LimitExceeded where a number is NaN or infinite, or speed or force negative.
        """
        _require_finite("gripper", command.aperture_m, command.speed_m_s, command.force_n)
        if command.speed_m_s < 0 or command.force_n < 0:
            raise LimitExceeded("gripper", "speed and force are magnitudes and must not be negative")
        limits, counts = self._options, self.counts
        force, changed = _at_most(command.force_n, limits.max_grip_force_n)
        counts.force += changed
        speed, changed = _at_most(command.speed_m_s, limits.max_finger_speed_m_s)
        counts.finger_speed += changed
        aperture = max(command.aperture_m, limits.min_aperture_m)
        if limits.max_aperture_m is not None:
            aperture = min(aperture, limits.max_aperture_m)
        counts.aperture += aperture != command.aperture_m
        if not allow_opening:
            _require_finite("gripper", held_aperture_m)
            if aperture > held_aperture_m:
                aperture = held_aperture_m
                counts.kept_closed += 1
        return replace(command, aperture_m=aperture, speed_m_s=speed, force_n=force)

    def arm(self, command: ArmCommand) -> ArmCommand:
        """Return the command within the limits; a twist that is too fast keeps its direction.

        Raises LimitExceeded where a number is NaN or infinite, or the acceleration is not positive.
        """
        twist = command.twist
        _require_finite("arm", *twist.linear_m_s, *twist.angular_rad_s, command.acceleration_m_s2)
        if command.acceleration_m_s2 <= 0:
            raise LimitExceeded("arm", "the acceleration must be positive, or the arm could never come to rest")
        limits, counts = self._options, self.counts
        linear, changed = _scaled(twist.linear_m_s, limits.max_arm_speed_m_s)
        counts.arm_speed += changed
        angular, changed = _scaled(twist.angular_rad_s, limits.max_arm_angular_rad_s)
        counts.arm_angular += changed
        acceleration, changed = _at_most(command.acceleration_m_s2, limits.max_arm_acceleration_m_s2)
        counts.arm_acceleration += changed
        return ArmCommand(Twist(linear, angular), acceleration, command.expires_ns)


class Watchdog:
    """Calls `stop` once where the loop has been silent for longer than `timeout_s`.

    `now` is a monotonic source in nanoseconds. `start` runs the check in a thread of its own; a loop feeds with
    `feed()` and asks `check()`, which raises SafetyStop after the watchdog has fired. Under the virtual clock there is
    nothing to watch: a single thread cannot stall against itself.
    """

    def __init__(self, stop: Callable[[], object], timeout_s: float, now: Callable[[], int]) -> None:
        self._stop = stop
        self._timeout_ns = nanoseconds(timeout_s)
        self._now = now
        self._fed_ns = now()
        self._silence_ns: int | None = None
        self._failure: str = ""
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def fired(self) -> bool:
        """Whether the watchdog has stopped the cell."""
        return self._silence_ns is not None

    def feed(self) -> None:
        """Tell that the loop is alive."""
        self._fed_ns = self._now()

    def check(self) -> None:
        """Raise SafetyStop where the watchdog has fired."""
        if self._silence_ns is not None:
            raise SafetyStop(
                f"watchdog: the loop was silent for {seconds(self._silence_ns):.3f} s, allowed are "
                f"{seconds(self._timeout_ns):.3f} s; the cell was stopped{self._failure}. Look for what blocked the "
                "loop (lsds run --json shows each task's longest run), or raise safety.watchdog_s"
            )

    def poll(self) -> bool:
        """Check once; call `stop` where the loop has been silent too long. Return whether the watchdog has fired."""
        silence = self._now() - self._fed_ns
        if self._silence_ns is None and silence > self._timeout_ns:
            self._silence_ns = silence
            try:
                self._stop()
            except Exception as error:
                self._failure = f" (and stopping raised {type(error).__name__}: {error})"
        return self.fired

    def start(self) -> None:
        """Begin to watch. The silence counts from now."""
        self.feed()
        self._thread = threading.Thread(target=self._watch, name="lsds-watchdog", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End watching. Does nothing the second time."""
        self._closing.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(timeout=1.0)

    def __enter__(self) -> Watchdog:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _watch(self) -> None:
        # A quarter of the time-out, so that the stop comes at most 25 % late.
        while not self._closing.wait(seconds(self._timeout_ns) / 4):
            if self.poll():
                return


def _require_finite(device: str, *numbers: float) -> None:
    if not all(map(math.isfinite, numbers)):
        raise LimitExceeded(device, "a command held NaN or infinity and was not sent")


def _at_most(value: float, limit: float) -> tuple[float, bool]:
    return (limit, True) if value > limit else (value, False)


def _scaled(vector: tuple[float, float, float], limit: float) -> tuple[tuple[float, float, float], bool]:
    length = math.hypot(*vector)
    if length <= limit:
        return vector, False
    x, y, z = vector
    # Dividing first keeps the product finite for lengths near the largest double.
    return (x / length * limit, y / length * limit, z / length * limit), True
