"""Limits and watchdog. They limit the effect of mistakes and are not a safety function.

Nothing here is certified or redundant, and all of it runs on the computer that it monitors. People are protected by the
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
    """Options of the `[safety]` table: limits of the cell, in addition to those of each device."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    max_grip_force_n: float = Field(default=100.0, gt=0, le=500, description="maximum force of the gripper")
    max_finger_speed_m_s: float = Field(default=0.15, gt=0, le=1, description="maximum finger speed")
    max_arm_speed_m_s: float = Field(default=0.1, gt=0, le=2, description="maximum linear TCP speed")
    max_arm_angular_rad_s: float = Field(default=0.5, gt=0, le=10, description="maximum angular TCP speed")
    max_arm_acceleration_m_s2: float = Field(default=1.0, gt=0, le=20, description="maximum TCP acceleration")
    min_aperture_m: float = Field(default=0.0, ge=0, le=0.5, description="minimum aperture")
    max_aperture_m: float | None = Field(default=None, gt=0, le=0.5, description="maximum aperture")
    stale_after_s: float = Field(default=0.2, gt=0, le=10, description="stop if no new frame has arrived for this time")
    frozen_after_s: float = Field(
        default=0.2,
        gt=0,
        le=3600,
        description="stop if the camera repeats one image for this time; not before stale_after_s",
    )
    watchdog_s: float = Field(default=0.5, gt=0, le=10, description="stop if the loop is silent for this time")
    command_lifetime_s: float = Field(default=0.1, gt=0, le=10, description="lifetime of a motion command")

    @property
    def apertures_m(self) -> tuple[float, float]:
        """The least and the greatest aperture, m."""
        return self.min_aperture_m, math.inf if self.max_aperture_m is None else self.max_aperture_m


@dataclass(slots=True)
class GuardCounts:
    """Number of commands that each limit changed."""

    force: int = 0
    finger_speed: int = 0
    aperture: int = 0
    kept_closed: int = 0
    arm_speed: int = 0
    arm_angular: int = 0
    arm_acceleration: int = 0


class Guard:
    """Clamps commands to the cell's limits and counts the changes; refuses NaN and infinity."""

    def __init__(self, options: SafetyOptions) -> None:
        self._options = options
        self.counts = GuardCounts()

    def gripper(self, command: GripperCommand, held_aperture_m: float, *, allow_opening: bool) -> GripperCommand:
        """Return the command clamped to the limits.

        `held_aperture_m` is the aperture last sent to the gripper. An automatic grip correction passes
        `allow_opening=False` and can then only close: a sign error or a bad estimate must not release the object. A
        release requested by the task, and the demonstration of the paper's literal sign, pass True. Raises
        LimitExceeded if a number is NaN or infinite, or if speed or force is negative.
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
        """Return the command clamped to the limits; a twist that is too fast keeps its direction.

        Raises LimitExceeded if a number is NaN or infinite, or if the acceleration is not positive.
        """
        twist = command.twist
        _require_finite("arm", *twist.linear_m_s, *twist.angular_rad_s, command.acceleration_m_s2)
        if command.acceleration_m_s2 <= 0:
            raise LimitExceeded("arm", "the acceleration must be positive, otherwise the arm could not come to rest")
        limits, counts = self._options, self.counts
        linear, changed = _scaled(twist.linear_m_s, limits.max_arm_speed_m_s)
        counts.arm_speed += changed
        angular, changed = _scaled(twist.angular_rad_s, limits.max_arm_angular_rad_s)
        counts.arm_angular += changed
        acceleration, changed = _at_most(command.acceleration_m_s2, limits.max_arm_acceleration_m_s2)
        counts.arm_acceleration += changed
        return ArmCommand(Twist(linear, angular), acceleration, command.expires_ns)


class Watchdog:
    """Calls `stop` once if the loop has not called `feed()` for longer than `timeout_s`.

    `now` is a monotonic source in nanoseconds; `doing` tells what the loop is in the middle of, "" if unknown. `start`
    runs the check in its own thread; the loop calls `feed()` and `check()`, which raises SafetyStop after the watchdog
    has fired. Not used with the virtual clock, where a single thread cannot stall in simulated time.
    """

    def __init__(
        self,
        stop: Callable[[], object],
        timeout_s: float,
        now: Callable[[], int],
        doing: Callable[[], str] = lambda: "",
    ) -> None:
        self._stop = stop
        self._timeout_ns = nanoseconds(timeout_s)
        self._now = now
        self._fed_ns = now()
        self._silence_ns: int | None = None
        self._doing = doing
        self._polled_ns = self._fed_ns
        self._late_ns = 0
        self._cause = ""
        self._failure: str = ""
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def fired(self) -> bool:
        """True if the watchdog has stopped the cell."""
        return self._silence_ns is not None

    def feed(self) -> None:
        """Report that the loop is running."""
        self._fed_ns, self._late_ns = self._now(), 0

    def check(self, cause: Exception | None = None) -> None:
        """Raise SafetyStop if the watchdog has fired, `from` the error that this led to."""
        if self._silence_ns is not None:
            raise SafetyStop(
                f"watchdog: the loop was silent for {seconds(self._silence_ns):.3f} s, the limit is "
                f"{seconds(self._timeout_ns):.3f} s{self._cause}{self._failure}. Find what "
                "blocked the loop (lsds run --json shows the longest run of each task), or increase safety.watchdog_s"
            ) from cause

    def poll(self) -> bool:
        """Check once; call `stop` if the loop has been silent for too long. Return whether the watchdog has fired."""
        now = self._now()
        # The watchdog wakes by the clock alone: where it wakes late, the machine did not run this process.
        late, self._polled_ns = now - self._polled_ns - self._timeout_ns // 4, now
        self._late_ns += max(late, 0)
        silence = now - self._fed_ns
        if self._silence_ns is None and silence > self._timeout_ns:
            self._silence_ns = silence
            self._cause = self._why(silence)
            try:
                self._stop()
            except Exception as error:
                self._failure = f"; and stopping raised {type(error).__name__}: {error}"
        return self.fired

    def _why(self, silence_ns: int) -> str:
        if 2 * self._late_ns > silence_ns:
            return f"; the watchdog itself was not run for {seconds(self._late_ns):.3f} s of it: the machine is busy"
        doing = self._doing()
        return f", in {doing}" if doing else ""

    def start(self) -> None:
        """Start watching. The time of silence counts from now."""
        self.feed()
        self._polled_ns = self._fed_ns
        self._thread = threading.Thread(target=self._watch, name="lsds-watchdog", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop watching. A second call does nothing."""
        self._closing.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(timeout=1.0)

    def __enter__(self) -> Watchdog:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _watch(self) -> None:
        # Check every quarter of the time-out, so that the stop is at most 25 % late.
        while not self._closing.wait(seconds(self._timeout_ns) / 4):
            if self.poll():
                return


def _require_finite(device: str, *numbers: float) -> None:
    if not all(map(math.isfinite, numbers)):
        raise LimitExceeded(device, "a command contained NaN or infinity and was not sent")


def _at_most(value: float, limit: float) -> tuple[float, bool]:
    return (limit, True) if value > limit else (value, False)


def _scaled(vector: tuple[float, float, float], limit: float) -> tuple[tuple[float, float, float], bool]:
    length = math.hypot(*vector)
    if length <= limit:
        return vector, False
    x, y, z = vector
    # Dividing first keeps the product finite for lengths near the largest double.
    return (x / length * limit, y / length * limit, z / length * limit), True
