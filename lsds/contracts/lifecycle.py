"""The life cycle of a device: NEW -> CONNECTED -> ARMED -> CONNECTED -> CLOSED.

A driver or a mock holds one `LifecycleGuard` and wraps its transitions in it. `stop` is allowed in every state and from
every thread, so it does not use the guard: it would have to wait for a lock that a blocked `connect` holds.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from lsds.contracts.devices import Lifecycle
from lsds.errors import LifecycleError

_REMEDY = {
    Lifecycle.NEW: "call connect() first",
    Lifecycle.CONNECTED: "call arm() first",
    Lifecycle.ARMED: "call disarm() first",
    Lifecycle.CLOSED: "a closed device is final; build a new one",
}


class LifecycleGuard:
    """Holds the state of one device and refuses calls in the wrong state.

    Transitions exclude each other by a lock; `state`, `require_readable` and `require_armed` never wait.
    """

    def __init__(self, device: str) -> None:
        self._device = device
        self._state = Lifecycle.NEW
        self._lock = threading.RLock()

    @property
    def state(self) -> Lifecycle:
        """The state of the device's life cycle."""
        return self._state

    def require_readable(self, call: str = "read") -> None:
        """Raise LifecycleError unless the device is connected or armed."""
        if self._state is not Lifecycle.CONNECTED and self._state is not Lifecycle.ARMED:
            raise self._refusal(call)

    def require_armed(self, call: str = "command") -> None:
        """Raise LifecycleError unless the device is armed."""
        if self._state is not Lifecycle.ARMED:
            raise self._refusal(call)

    @contextmanager
    def connecting(self) -> Iterator[None]:
        """Go from NEW to CONNECTED around the body; stay NEW where it raises. Raises LifecycleError elsewhere."""
        with self._lock:
            self._require(Lifecycle.NEW, "connect")
            yield
            self._state = Lifecycle.CONNECTED

    @contextmanager
    def arming(self) -> Iterator[None]:
        """Go from CONNECTED to ARMED around the body; stay where it raises. Raises LifecycleError elsewhere."""
        with self._lock:
            self._require(Lifecycle.CONNECTED, "arm")
            yield
            self._state = Lifecycle.ARMED

    @contextmanager
    def disarming(self) -> Iterator[bool]:
        """Yield True if the device is armed, so that there is something to switch off.

        The state is CONNECTED afterwards even if the body raises: refusing commands is the safe side.
        """
        with self._lock:
            armed = self._state is Lifecycle.ARMED
            try:
                yield armed
            finally:
                if armed:
                    self._state = Lifecycle.CONNECTED

    @contextmanager
    def closing(self) -> Iterator[bool]:
        """Yield True on the first call. CLOSED is final, even if the body raises."""
        with self._lock:
            first = self._state is not Lifecycle.CLOSED
            try:
                yield first
            finally:
                self._state = Lifecycle.CLOSED

    def _require(self, state: Lifecycle, call: str) -> None:
        if self._state is not state:
            raise self._refusal(call)

    def _refusal(self, call: str) -> LifecycleError:
        return LifecycleError(
            self._device, f"{call}() is not allowed while {self._state.value}", remedy=_REMEDY[self._state]
        )


class MotionlessLife:
    """A mixin with the life cycle of sensors: there is nothing to activate or to stop.

    The class sets `_guard` and writes `connect` and `close` itself.
    """

    _guard: LifecycleGuard

    @property
    def lifecycle(self) -> Lifecycle:
        """Where the device is in its life."""
        return self._guard.state

    def arm(self) -> None:
        """Go to ARMED; there is nothing to activate."""
        with self._guard.arming():
            pass

    def stop(self) -> None:
        """Nothing moves."""

    def disarm(self) -> None:
        """Back to readable only."""
        with self._guard.disarming():
            pass
