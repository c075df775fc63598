"""A test bench: builds a new device with a new clock for each check, and advances its time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any, TypeVar

from lsds.clock import NS_PER_S, Clock, VirtualClock, WallClock, nanoseconds
from lsds.contracts.backend import BuildContext
from lsds.contracts.devices import Lifecycle
from lsds.contracts.kinds import Kind
from lsds.errors import StaleData
from lsds.registry.host import PluginHost

T = TypeVar("T")

FIRST_SAMPLE_S = 5.0
"""Time allowed from `connect` to the first sample, s."""

_CLOCK_STEP_NS = 1_000_000
"""Step by which the virtual clock advances, ns; chosen."""


@dataclass
class Bench:
    """The test bench of one backend, with virtual time if the backend supports it, else with the wall clock.

    Without `allow_motion` no check arms a backend that is not simulated, so that no real device moves unintentionally.
    `unplug` takes a connected device and cuts its connection; without it the checks of a lost connection are skipped.
    """

    kind: Kind
    name: str
    options: Mapping[str, Any] = field(default_factory=dict)
    host: PluginHost = field(default_factory=PluginHost)
    allow_motion: bool = False
    unplug: Callable[[Any], None] | None = None

    def __post_init__(self) -> None:
        self.virtual = self.host.find(self.kind, self.name).spec.virtual_time
        self.clock: Clock = WallClock()
        self._context = BuildContext(self.clock)

    @property
    def may_move(self) -> bool:
        """True if checks may arm the device."""
        return self.virtual or self.allow_motion

    def build(self, seed: int = 0) -> Any:
        """Return a new device with a new clock and its own cell."""
        self.clock = VirtualClock() if self.virtual else WallClock()
        self._context = BuildContext(self.clock, seed)
        return self.build_beside()

    def build_beside(self) -> Any:
        """Return a further device on the clock and in the cell of the last one that was built."""
        return self.host.build(self.kind, self.name, self.options, self._context)

    @contextmanager
    def device(self, state: Lifecycle = Lifecycle.CONNECTED) -> Iterator[Any]:
        """Yield a new device in a given state; it is always closed afterwards."""
        device = self.build()
        try:
            if state is not Lifecycle.NEW:
                device.connect()
            if state is Lifecycle.ARMED:
                device.arm()
            yield device
        except BaseException:
            with suppress(Exception):  # Report the first error, not that of close().
                device.close()
            raise
        device.close()

    def advance(self, duration_s: float) -> None:
        """Advance the time."""
        self.clock.sleep_until(self.clock.now() + nanoseconds(duration_s))

    def read(self, device: Any) -> Any:
        """Return a sample, waiting for the first one. Raises StaleData if none arrives within `FIRST_SAMPLE_S`."""
        deadline = self.clock.now() + nanoseconds(FIRST_SAMPLE_S)
        while True:
            try:
                return device.read()
            except StaleData:
                if self.clock.now() > deadline:
                    raise
                self.clock.sleep_until(self.clock.now() + _CLOCK_STEP_NS)

    def samples(self, device: Any, duration_s: float, step_s: float = 0.004) -> Iterator[Any]:
        """Yield samples while time passes; ends early at the end of a recording."""
        deadline = self.clock.now() + nanoseconds(duration_s)
        yield self.read(device)
        while self.clock.now() < deadline:
            self.advance(step_s)
            try:
                yield device.read()
            except EOFError:
                return
            except StaleData:
                continue

    def settle(self, done: Callable[[], bool], timeout_s: float, step_s: float = 0.01) -> bool:
        """Advance the time until `done()` is true; return whether it became true."""
        deadline = self.clock.now() + nanoseconds(timeout_s)
        while not done():
            if self.clock.now() > deadline:
                return False
            self.advance(step_s)
        return True

    def in_future(self, s: float = 0.5) -> int:
        """Return an expiry (ns) in the future."""
        return self.clock.now() + round(s * NS_PER_S)
