"""Fingers of a single gripper mock without a plant: free, or with one compliant body in their way."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lsds.clock import seconds
from lsds.contracts.plant_links import FingerState
from lsds_mocks.plant.axis import FingerDrive

if TYPE_CHECKING:
    from lsds.clock import Clock

_PLANT_STEP_NS = 250_000
"""Time step. At 150 mm/s the fingers travel 0.04 mm per step, so at 30 N/mm a contact stops within 1 N of its limit."""


class LoneFingers:
    """A `FingerLink` to fingers without a plant; every call advances them to the clock's present.

    `object_m` is the width of a body that closing fingers grip from outside, `hollow_m` the inner width of a body that
    opening fingers grip from inside; None for no body. `stiffness_n_m` is that of one finger on the body. `set_aside`
    removes the body, so that the fingers move freely.
    """

    def __init__(
        self,
        clock: Clock,
        *,
        aperture_m: float,
        object_m: float | None = None,
        hollow_m: float | None = None,
        stiffness_n_m: float = 30_000.0,
    ) -> None:
        self._clock = clock
        self._drive = FingerDrive(aperture_m, aperture_m)
        self._object_m = object_m
        self._hollow_m = hollow_m
        self._stiffness_n_m = stiffness_n_m
        self._now_ns = clock.now()
        self._pushes_out = False
        self._aside = self._awaited = False

    def set_aside(self, aside: bool) -> None:
        """Remove the body, or put it back as soon as it fits between or around the fingers."""
        self._advance()
        self._awaited = self._aside and not aside
        self._aside = self._aside or aside
        self._put_back()

    def drive(self, target_m: float, speed_m_s: float, limit_n: float) -> None:
        """Move to an aperture; takes effect at once."""
        self._advance()
        drive = self._drive
        drive.target_m, drive.speed_m_s, drive.limit_n = target_m, speed_m_s, limit_n
        drive.moving, drive.stalled = target_m != drive.aperture_m, False

    def hold(self) -> None:
        """Stay at the present aperture."""
        self._advance()
        self._drive.target_m = self._drive.aperture_m
        self._drive.moving = self._drive.stalled = False

    def fingers(self) -> FingerState:
        """Return the state at the clock's present."""
        self._advance()
        drive = self._drive
        return FingerState(
            self._now_ns,
            drive.aperture_m,
            drive.target_m,
            drive.moving and not self._pushes_out,
            drive.stalled or self._pushes_out,
            max(self._inward_n(), self._outward_n()),
        )

    def close(self) -> None:
        """Nothing is held."""

    def _inward_n(self) -> float:
        if self._object_m is None or self._aside:
            return 0.0
        return max(0.0, self._stiffness_n_m * (self._object_m - self._drive.aperture_m) / 2)

    def _outward_n(self) -> float:
        if self._hollow_m is None or self._aside:
            return 0.0
        return max(0.0, self._stiffness_n_m * (self._drive.aperture_m - self._hollow_m) / 2)

    def _put_back(self) -> None:
        aperture = self._drive.aperture_m
        fits = (self._object_m is None or aperture >= self._object_m) and (
            self._hollow_m is None or aperture <= self._hollow_m
        )
        if self._awaited and fits:
            self._aside = self._awaited = False

    def _advance(self) -> None:
        """Step up to the present; a gripper at rest skips the steps."""
        now, drive = self._clock.now(), self._drive
        while self._now_ns < now:
            step = min(_PLANT_STEP_NS, now - self._now_ns)
            if self._awaited:
                self._put_back()
            self._pushes_out = drive.target_m > drive.aperture_m and self._outward_n() >= drive.limit_n
            if not self._pushes_out:
                drive.step(seconds(step), self._inward_n())
            if self._pushes_out or not drive.moving:
                self._now_ns = now
                return
            self._now_ns += step
