"""Monitor of a gripper's fingers: they must not open without a command, and must follow a command to close."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

from lsds.clock import nanoseconds, seconds
from lsds.contracts import Contact
from lsds.errors import DeviceFault, SafetyStop

if TYPE_CHECKING:
    from lsds.contracts import GripperState

UNDER_WAY_S = 0.5
"""Time after which a command cannot be under way any more (s); chosen."""
UNHEARD_S = 2.0
"""The same, if the gripper still reports the command as its target: later commands may be lost (s); chosen."""
OPENED_TICKS = 3
"""Number of position ticks by which the aperture must exceed the bound before the fingers have opened; chosen."""
LEAST_OPENED_M = 8e-4
"""Minimum length by which it must exceed the bound, for grippers with fine ticks (m); chosen."""
REPEAT_S = 0.4
"""Time after which a correction that the gripper does not report as its target is sent again (s); chosen."""
PATIENCE_S = 0.4
"""Time for which fingers may rest on nothing, wider than commanded, before they count as not following (s); chosen."""
PATIENCE_UNHEARD_S = 1.0
"""The same for a gripper that does not report the target, or that reports motion (s): a retry gets the time of a
gripper with 0.2 s latency."""


class FingersWatch:
    """Compares the reported states of the gripper with the commands sent to it, since the first command."""

    def __init__(self, resolution_m: float) -> None:
        self._near_m = max(OPENED_TICKS * resolution_m, LEAST_OPENED_M)
        self._tick_m = max(resolution_m, 1e-4)
        self._sent: deque[tuple[int, float]] = deque()
        self._bound_m = math.inf
        self._corrects, self._asked_m = False, math.nan
        self._taken_m, self._taken_ns = math.nan, 0
        self._idle_ns: int | None = None
        self._idle_m = math.nan

    def sent(self, asked_m: float, taken_m: float, now_ns: int, *, corrects: bool) -> None:
        """Take the aperture that was asked for and the one that the gripper took.

        `corrects`: the command is a correction, on which an object relies; a grasp has retries and limits of its job.
        Raises DeviceFault if the gripper took a wider aperture than its resolution explains: one that opens it, or one
        that is no correction.
        """
        # A gripper that cannot close that far takes a wider aperture than commanded, but does not open by that. A
        # correction that it cannot carry out is a fault, because the object keeps sliding.
        if taken_m > (asked_m if corrects else max(asked_m, self._bound_m)) + 1.01 * self._tick_m:
            raise DeviceFault(
                "gripper",
                f"took {1e3 * taken_m:.2f} mm for {1e3 * asked_m:.2f} mm, wider by more than its resolution",
                remedy="give its true resolution in its spec, set safety.min_aperture_m to its least aperture, or have "
                "command() return the commanded aperture instead of the measured one; lsds check tries it",
            )
        self._corrects, self._asked_m = corrects, asked_m
        self._taken_m, self._taken_ns = taken_m, now_ns
        self._sent.append((now_ns, taken_m))

    def check(self, state: GripperState, now_ns: int) -> None:
        """Take the gripper's newest state. Raises SafetyStop if the fingers opened, or do not close."""
        if not self._sent:
            return
        # The newest command that cannot be under way any more is where the fingers come from.
        while len(self._sent) > 1 and self._is_over(self._sent[1][0], self._sent[0][1], state, now_ns):
            self._sent.popleft()
        aperture_m = state.aperture_m
        self._bound_m = max(self._bound_m, *(sent for _, sent in self._sent))
        if aperture_m > self._bound_m + self._near_m:
            raise SafetyStop(
                f"gripper: its fingers opened from {1e3 * self._bound_m:.2f} to {1e3 * aperture_m:.2f} mm; "
                "no command asked for it (check its power, its fingers and its position sensor)"
            )
        self._bound_m = min(self._bound_m, aperture_m)
        self._require_following(state, now_ns)

    def lost(self, state: GripperState, now_ns: int) -> bool:
        """Return whether to send the last correction again: the gripper does not report it as its target."""
        return self._corrects and not self._heard(state) and now_ns - self._taken_ns > nanoseconds(REPEAT_S)

    def _heard(self, state: GripperState) -> bool:
        return abs(state.target_m - self._taken_m) <= 1.01 * self._tick_m

    def _is_over(self, next_ns: int, aperture_m: float, state: GripperState, now_ns: int) -> bool:
        """Return whether fingers cannot be on the way to an aperture any more; `next_ns`: the next command."""
        is_target = abs(state.target_m - aperture_m) <= 1.01 * self._tick_m
        return now_ns - next_ns > nanoseconds(UNHEARD_S if is_target else UNDER_WAY_S)

    def _require_following(self, state: GripperState, now_ns: int) -> None:
        wanted_m = self._asked_m
        # Fingers that report motion and do not change their aperture do not follow, either.
        behind = self._corrects and state.aperture_m > wanted_m + self._near_m and state.contact is Contact.NONE
        if not behind or not self._idle_m - state.aperture_m < self._tick_m:
            self._idle_ns, self._idle_m = (now_ns, state.aperture_m) if behind else (None, math.nan)
            return
        # A gripper that reports motion may be slow to begin, or slow from tick to tick.
        patience_s = PATIENCE_S if self._heard(state) and not state.moving else PATIENCE_UNHEARD_S
        if self._idle_ns is not None and now_ns - self._idle_ns > nanoseconds(patience_s):
            raise SafetyStop(
                f"gripper: commanded to {1e3 * wanted_m:.2f} mm, it stays at {1e3 * state.aperture_m:.2f} mm without "
                f"contact for {seconds(now_ns - self._idle_ns):.1f} s (is it stuck?)"
            )
