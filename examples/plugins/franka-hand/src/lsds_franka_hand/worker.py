"""The thread that runs the blocking commands, and the one that interrupts them.

Only the newest command is kept. A command that goes on in the same direction, at the same speed and force, waits for
the one that runs; any other interrupts it. `stop` of the hand takes the pressure off a held object, so it is called
only while a command runs, and not while a closing command holds an object.
"""

from __future__ import annotations

import threading
from typing import NamedTuple

from lsds.clock import Clock, nanoseconds
from lsds.errors import DeviceFault

from lsds_franka_hand.hand import SPEC, STROKE_M, Hand
from lsds_franka_hand.reader import JOIN_S, Reader, Status

REPEAT_S = 0.1
"""Time after which a stop that had no effect is sent again (s)."""
LOOK_S = 0.005
"""Time between looks at the newest state while a thread waits for it (s)."""
CONTACT_M = 2 * SPEC.resolution_m
"""Distance (m) from the target at which grasped fingers hold an object."""


class Motion(NamedTuple):
    """A motion that may start until `expires_ns`; or a homing."""

    aperture_m: float
    speed_m_s: float
    force_n: float
    expires_ns: int
    homing: bool = False


class Running(NamedTuple):
    """A motion that was started at `began_ns`, and whether it closes the fingers."""

    motion: Motion
    closes: bool
    began_ns: int


class Worker:
    """Runs motions one after the other. No method waits for the hand, except `wait` and `end`."""

    def __init__(self, name: str, reader: Reader, clock: Clock, interrupt_limit_s: float) -> None:
        self._name = name
        self._reader = reader
        self._clock = clock
        self._limit_ns = nanoseconds(interrupt_limit_s)
        self._changed = threading.Condition()
        self._due: Motion | None = None
        self._running: Running | None = None
        self._last: Running | None = None
        self._rested_ns = clock.now()
        self._interrupt_ns: int | None = None
        self._stop_sent = self._ended = False
        self._threads: list[threading.Thread] = []
        self.fault: DeviceFault | None = None
        self.target_m: float | None = None

    def start(self) -> None:
        """Start both threads."""
        for part, run in (("commands", self._run), ("interrupts", self._interrupt)):
            thread = threading.Thread(target=run, name=f"{self._name} {part}", daemon=True)
            self._threads.append(thread)
            thread.start()

    @property
    def busy(self) -> bool:
        """Whether a motion runs or is due."""
        with self._changed:
            return self._running is not None or self._due is not None

    def holds(self, status: Status) -> bool:
        """Whether no motion runs or is due, and the fingers hold an object."""
        with self._changed:
            return self._running is None and self._due is None and self._holds(status)

    def submit(self, motion: Motion) -> None:
        """Have a motion start as soon as possible, in place of any other that is due."""
        with self._changed:
            self._due, self.target_m = motion, motion.aperture_m
            if self._running is not None and not _goes_on(self._running, motion):
                self._request_interrupt()
            self._changed.notify_all()

    def halt(self) -> None:
        """Cancel what is due, and interrupt what runs."""
        with self._changed:
            self._due = self.target_m = None
            if self._running is not None:
                self._request_interrupt()
            self._changed.notify_all()

    def wait(self, timeout_s: float) -> bool:
        """Wait until no motion runs or is due; return whether that came in time."""
        with self._changed:
            return self._changed.wait_for(lambda: self._running is None and self._due is None, timeout_s)

    def end(self) -> None:
        """Halt and end both threads. A command that the hand does not end keeps its thread."""
        self.halt()
        self.wait(self._limit_ns * 1e-9)
        with self._changed:
            self._ended = True
            self._changed.notify_all()
        threads, self._threads = self._threads, []
        for thread in threads:
            thread.join(JOIN_S)

    # -- commands ---------------------------------------------------------------------------------------------

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._due is not None or self._ended)
                if self._ended:
                    return
                started = self._started()
                if started is None:
                    self._changed.wait(LOOK_S)
                    continue
                hand = self._reader.hand
            problem = _failure(hand, started)
            with self._changed:
                self._finish(started, problem)

    def _started(self) -> Running | None:
        """Return the motion that is due as the running one; None if it has to wait, or if there is nothing to do."""
        motion, status = self._due, self._reader.status
        if motion is None or status is None:
            return None
        if self._clock.now() >= motion.expires_ns:
            self._due = self.target_m = None
            self._changed.notify_all()
            return None
        if status.t_ns <= self._rested_ns:
            # Only a state that is newer than the last motion shows on which side of the target the fingers are.
            return None
        last, closes = self._last, not motion.homing and motion.aperture_m <= status.width_m
        # The hand holds with a force, not at a width, so closing with the same force would change nothing.
        kept = closes and last is not None and motion.force_n == last.motion.force_n and self._holds(status)
        if kept or (not motion.homing and abs(motion.aperture_m - status.width_m) < SPEC.resolution_m / 2):
            self._due = None
            self._changed.notify_all()
            return None
        self._due = None
        self._running, self._stop_sent = Running(motion, closes, self._clock.now()), False
        return self._running

    def _finish(self, running: Running, problem: str) -> None:
        stopped = self._stop_sent
        self._running, self._interrupt_ns = None, None
        self._rested_ns = self._clock.now()
        # An interrupted motion leaves the fingers at an unknown width.
        self._last = None if stopped or problem else running
        if problem and not stopped:
            self._fail(problem, "check the fingers, then disarm and arm the gripper")
        self._changed.notify_all()

    def _fail(self, problem: str, remedy: str) -> None:
        """Report a fault, and start nothing that was commanded before it."""
        self._due = self.target_m = None
        self.fault = DeviceFault(self._name, problem, remedy=remedy)

    def _holds(self, status: Status) -> bool:
        """Whether the fingers hold an object: grasped and at rest, before they reached the target of a closing.

        The hand reports a grasp also if it reached that target without an object.
        """
        running, last = self._running, self._last
        if not status.grasped or (status.t_ns <= self._rested_ns if running is None else not status.still):
            return False
        of = running if running is not None and status.t_ns > running.began_ns else last
        return of is None or not of.closes or status.width_m > of.motion.aperture_m + CONTACT_M

    # -- interrupts -------------------------------------------------------------------------------------------

    def _request_interrupt(self) -> None:
        if self._interrupt_ns is None:
            self._interrupt_ns = self._clock.now()

    def _interrupt(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._interrupt_ns is not None or self._ended)
                if self._ended:
                    return
                running, began_ns, hand = self._running, self._interrupt_ns, self._reader.hand
                if running is None or began_ns is None or hand is None or not self._may_stop(running):
                    self._changed.wait(LOOK_S)
                    continue
                if self._clock.now() - began_ns > self._limit_ns:
                    problem = f"a command has not ended {self._limit_ns * 1e-9:g} s after it was stopped"
                    self._fail(problem, "use the emergency stop if the fingers move, then restart the hand")
                self._stop_sent = True
            _stop(hand)
            with self._changed:
                self._changed.wait_for(lambda: self._interrupt_ns is None or self._ended, REPEAT_S)

    def _may_stop(self, running: Running) -> bool:
        """Whether a stop drops nothing: no object is held, or the motion that is due opens the fingers anyway."""
        status, due = self._reader.status, self._due
        if not running.closes or status is None or not self._holds(status):
            return True
        return due is not None and due.aperture_m > status.width_m


def _goes_on(running: Running, motion: Motion) -> bool:
    """Whether a motion goes on where the running one ends."""
    now = running.motion
    if running.motion.homing or motion[1:3] != now[1:3]:
        return False
    return motion.aperture_m <= now.aperture_m if running.closes else motion.aperture_m >= now.aperture_m


def _failure(hand: Hand | None, running: Running) -> str:
    """Run a motion to its end; return what failed, or an empty string."""
    motion = running.motion
    what = f"the motion to {motion.aperture_m * 1e3:.1f} mm"
    if hand is None:
        return f"{what} did not start: the connection is lost"
    try:
        if motion.homing:
            what, done = "the homing", hand.homing()
        elif running.closes:
            # With the widest tolerance every contact is a success, and the force is limited.
            done = hand.grasp(motion.aperture_m, motion.speed_m_s, motion.force_n, STROKE_M, STROKE_M)
        else:
            done = hand.move(motion.aperture_m, motion.speed_m_s)
    except Exception as error:  # libfranka's exceptions have no common base class in Python
        return f"{what} failed: {error}"
    # A grasp without success is no failure: the hand may hold the object already.
    return "" if done or running.closes else f"{what} failed: the hand reports no success"


def _stop(hand: Hand) -> None:
    """Send a stop. If it fails, the caller repeats it until the command has ended."""
    try:
        hand.stop()
    except Exception:  # libfranka's exceptions have no common base class in Python
        return
