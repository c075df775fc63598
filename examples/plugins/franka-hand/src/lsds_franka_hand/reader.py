"""The thread that reads the states of the hand, and opens the connection again when it is lost."""

from __future__ import annotations

import threading
from typing import NamedTuple

from lsds.clock import Clock
from lsds.errors import ConnectFailed, ConnectionLost, DeviceError, ProtocolFault

from lsds_franka_hand.hand import STROKE_M, Hand, Opener

RETRY_S = 0.5
"""Time between attempts to open a lost connection (s)."""
JOIN_S = 0.5
"""Time that `stop` waits for the thread (s). libfranka may block longer if the hand is silent."""
STILL_M = 1e-4
"""Greatest change of width between two states of fingers at rest (m), assumed."""
ROOM_M = 0.01
"""Tolerance of a plausible width (m), for other fingertips."""


class Status(NamedTuple):
    """One state and its time of arrival. `still`: the width is that of the state before."""

    t_ns: int
    seq: int
    width_m: float
    max_width_m: float
    grasped: bool
    still: bool


class Reader:
    """Keeps the newest status. `hand`, `status` and `trouble` are safe to read from any thread."""

    def __init__(self, name: str, opener: Opener, clock: Clock) -> None:
        self._name = name
        self._opener = opener
        self._clock = clock
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None
        self.hand: Hand | None = None
        self.status: Status | None = None
        self.trouble: DeviceError | None = None

    def start(self) -> None:
        """Open the connection, read the first state, and start the thread. Raises DeviceError."""
        self.hand = self._open()
        try:
            self._read(self.hand)
        except DeviceError:
            self.hand = None
            raise
        self._thread = threading.Thread(target=self._run, name=f"{self._name} state", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread and release the connection. A second call does nothing."""
        self._ended.set()
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.join(JOIN_S)
        self.hand = None

    def _run(self) -> None:
        while not self._ended.is_set():
            try:
                hand = self.hand
                if hand is None:
                    hand = self._open()
                    self.hand = hand
                self._read(hand)
                self.trouble = None
            except DeviceError as error:
                self.trouble, self.hand = error, None
                self._ended.wait(RETRY_S)

    def _open(self) -> Hand:
        try:
            return self._opener()
        except DeviceError:
            raise
        except Exception as error:  # libfranka's exceptions have no common base class in Python
            remedy = "check the address, unlock the robot, and activate the FCI in Desk"
            raise ConnectFailed(self._name, f"no connection to the hand: {error}", remedy=remedy) from error

    def _read(self, hand: Hand) -> None:
        try:
            state = hand.read_once()
        except Exception as error:  # libfranka's exceptions have no common base class in Python
            problem = f"the hand sends no state: {error}"
            raise ConnectionLost(self._name, problem, remedy="check the robot and its network") from error
        if not -ROOM_M <= state.width <= STROKE_M + ROOM_M:
            problem = f"the state shows a width of {state.width * 1e3:.1f} mm"
            raise ProtocolFault(self._name, problem, remedy="home the hand, and check that it is a Franka Hand")
        last = self.status
        seq, still = (0, True) if last is None else (last.seq + 1, abs(state.width - last.width_m) <= STILL_M)
        now_ns = self._clock.now() if last is None else max(self._clock.now(), last.t_ns + 1)
        self.status = Status(now_ns, seq, max(state.width, 0.0), state.max_width, bool(state.is_grasped), still)
