"""Test whether a gripper at rest still refreshes its registers.

A gripper that holds an object repeats one status, and so does a gripper whose firmware has stopped. The test clears the
go-to bit, waits until the status shows it, and sets it again. It never writes a position: the gripper holds its
aperture, then resumes its last motion. According to the manuals this moves nothing; it was not tried on a real gripper.
"""

from __future__ import annotations

from enum import Enum

from lsds_drivers.robotiq.registers import ACTIVATE, GO_TO, Activation, Detection, Motion, Status

REST_SETTLE_NS = 200_000_000
"""Time allowed for a gripper to report that it rests again after the test."""


class _Phase(Enum):
    IDLE = 0
    CLEARING = 1
    RESTORING = 2
    SETTLING = 3


class SignOfLife:
    """Plans the test; does no I/O. `period_ns` is the time without a change of the status after which a test begins; 0
    disables tests."""

    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self._phase = _Phase.IDLE
        self._changed_ns = self._since_ns = self._shown_ns = 0
        self._last: Status | None = None
        self._before: Status | None = None

    @property
    def unanswered_ns(self) -> int | None:
        """Time (ns) at which the go-to bit was cleared, as long as the status does not show it; None otherwise."""
        return self._since_ns if self._phase is _Phase.CLEARING else None

    @property
    def moving_since_ns(self) -> int | None:
        """Time (ns) of the last change of a status that reports motion; None if the newest one reports none."""
        last = self._last
        if last is None or last.activation is not Activation.ACTIVE:
            return None
        return self._shown_ns if last.going and last.detection is Detection.MOVING else None

    def defers(self, motion: Motion | None) -> bool:
        """Return whether a motion has to wait until the status shows the cleared bit.

        That applies to a motion to the present target, which would set the bit too early and have no other effect.
        """
        if self._phase is not _Phase.CLEARING or motion is None or self._last is None:
            return False
        return motion.position == self._last.echo

    @property
    def pending(self) -> bool:
        """Whether a test is in progress, which should end soon."""
        return self._phase is not _Phase.IDLE

    def overtaken(self, motion: Motion | None, now_ns: int) -> None:
        """Record another acknowledged request, which sets or clears the bit itself; a test in progress ends.

        Such requests are no sign of life, because repeated requests for one position do not change the status. After a
        test, a request for that position sets the bit as the test would have done.
        """
        same = motion is not None and self._last is not None and motion.position == self._last.echo
        self._phase = _Phase.SETTLING if same and self.pending else _Phase.IDLE
        self._since_ns = now_ns

    def interrupted(self, now_ns: int) -> None:
        """Record a failed request. The bit is set again as soon as the gripper answers."""
        self._changed_ns = now_ns
        if self._phase is not _Phase.IDLE:
            self._phase = _Phase.RESTORING

    def request(self, now_ns: int) -> int | None:
        """Return the action byte to write now, or None."""
        status = self._last
        if status is None or status.activation is not Activation.ACTIVE:
            return None
        if self._phase is _Phase.RESTORING:
            return ACTIVATE | GO_TO
        rests = status.going and status.detection is not Detection.MOVING
        if self._phase is _Phase.IDLE and rests and 0 < self._period_ns <= now_ns - self._changed_ns:
            return ACTIVATE
        return None

    def sending(self, action: int, now_ns: int) -> None:
        """Record a request of this test before it is written, because it may be executed without acknowledgement."""
        if action & GO_TO:
            self._phase = _Phase.SETTLING
        else:
            self._phase, self._before = _Phase.CLEARING, self._last
        self._since_ns = now_ns

    def shown(self, status: Status, now_ns: int) -> Status:
        """Process a new status; during a test, return it with the go-to bit and the detection from before the test."""
        changed, self._last = status != self._last, status
        if changed:
            self._changed_ns = self._shown_ns = now_ns
        if self._phase is _Phase.IDLE:
            return status
        if self._phase is _Phase.CLEARING and not status.going:
            self._phase = _Phase.RESTORING
        elif self._phase is _Phase.SETTLING:
            rests = status.going and status.detection is not Detection.MOVING
            moved = self._before is not None and abs(status.position - self._before.position) > 1
            if rests or moved or now_ns - self._since_ns > REST_SETTLE_NS:
                self._phase = _Phase.IDLE
                return status
        before = self._before
        if before is None:
            return status
        return status._replace(going=before.going, detection=before.detection)
