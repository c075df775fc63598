"""A bench: makes a fresh device with a fresh clock for each check, and moves time for it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, TypeVar

from lsds.clock import NS_PER_S, Clock, VirtualClock, WallClock, nanoseconds
from lsds.contracts.backend import BuildContext
from lsds.contracts.devices import Lifecycle
from lsds.contracts.kinds import Kind
from lsds.errors import StaleData
from lsds.plugins.host import PluginHost

T = TypeVar("T")

FIRST_SAMPLE_S = 5.0
"""How long after `connect` a device may take to have its first sample."""

_STEP_NS = 1_000_000


@dataclass
class Bench:
    """Where one backend is tried: under virtual time where it can, else under the wall clock.

    `allow_motion` has to be given for a backend that is not simulated before any check arms it: no checker moves a
    real device unasked.
    """

    kind: Kind
    name: str
    options: Mapping[str, Any] = field(default_factory=dict)
    host: PluginHost = field(default_factory=PluginHost)
    allow_motion: bool = False

    def __post_init__(self) -> None:
        self.virtual = self.host.find(self.kind, self.name).spec.virtual_time
        self.clock: Clock = WallClock()

    @property
    def may_move(self) -> bool:
        """Whether checks may arm the device."""
        return self.virtual or self.allow_motion

    def build(self, seed: int = 0) -> Any:
        """Return a fresh device, on a fresh clock and a cell of its own."""
        self.clock = VirtualClock() if self.virtual else WallClock()
        return self.host.build(self.kind, self.name, self.options, BuildContext(self.clock, seed))

    @contextmanager
    def device(self, state: Lifecycle = Lifecycle.CONNECTED) -> Iterator[Any]:
        """Give a fresh device in a state; it is closed afterwards whatever happens."""
        device = self.build()
        try:
            if state is not Lifecycle.NEW:
                device.connect()
            if state is Lifecycle.ARMED:
                device.arm()
            yield device
        finally:
            device.close()

    def advance(self, duration_s: float) -> None:
        """Let time pass."""
        self.clock.sleep_until(self.clock.now() + nanoseconds(duration_s))

    def read(self, device: Any) -> Any:
        """Return a sample, waiting for the first one. Raises StaleData where none came in `FIRST_SAMPLE_S`."""
        deadline = self.clock.now() + nanoseconds(FIRST_SAMPLE_S)
        while True:
            try:
                return device.read()
            except StaleData:
                if self.clock.now() > deadline:
                    raise
                self.clock.sleep_until(self.clock.now() + _STEP_NS)

    def samples(self, device: Any, duration_s: float, step_s: float = 0.004) -> Iterator[Any]:
        """Yield what reading gives while time passes, ending early where a recording ends."""
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
        """Let time pass until `done()`; tell whether it came about."""
        deadline = self.clock.now() + nanoseconds(timeout_s)
        while not done():
            if self.clock.now() > deadline:
                return False
            self.advance(step_s)
        return True

    def in_future(self, s: float = 0.5) -> int:
        """Return an expiry (ns) that lies ahead."""
        return self.clock.now() + round(s * NS_PER_S)
