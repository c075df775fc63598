"""The DIGIT in the simulated cell: a camera that exposes the gel of the plant."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from lsds.clock import Clock
from lsds.contracts import BuildContext, Frame, SensorSpec
from lsds.contracts.lifecycle import LifecycleGuard, MotionlessLife
from lsds.contracts.plant import Plant, Touch, join
from lsds.errors import StaleData

from lsds_digit.drawing import GelDrawing
from lsds_digit.options import MockOptions

NAME = "mock-digit"
LATENCY_NS = 20_000_000
"""Time from exposure until a frame can be read (ns), assumed."""


class Exposure(NamedTuple):
    """The gel at one exposure. Only exposures that are read are drawn."""

    t_ns: int
    seq: int
    touch: Touch


class CellCamera:
    """A camera of the plant; see `lsds.contracts.plant.Exposing`."""

    def __init__(self, plant: Plant, clock: Clock, spec: SensorSpec, seed: list[int]) -> None:
        self._plant = plant
        self._clock = clock
        self._drawing = GelDrawing(spec, seed)
        self._period_ns = round(1e9 / spec.rate_hz)
        self._exposed: deque[Exposure] = deque()
        self._shown: Frame | None = None
        self._seq = 0
        self.next_exposure_ns = 0

    def open(self) -> None:
        """Expose from now on."""
        now_ns = self._clock.now()
        self._plant.advance(now_ns)
        self.next_exposure_ns = now_ns + self._period_ns
        self._plant.watch(self)

    def close(self) -> None:
        """Expose no more."""
        self._plant.unwatch(self)

    def expose(self, touch: Touch) -> None:
        """Keep the gel of this instant."""
        self._exposed.append(Exposure(self.next_exposure_ns, self._seq, touch))
        self._forget(self.next_exposure_ns)
        self.next_exposure_ns += self._period_ns
        self._seq += 1

    def newest(self) -> Frame | None:
        """Return the newest frame that has arrived, None before the first."""
        now_ns = self._clock.now()
        self._plant.advance(now_ns)
        self._forget(now_ns)
        if self._exposed and self._exposed[0].t_ns + LATENCY_NS <= now_ns:
            t_ns, seq, touch = self._exposed[0]
            if self._shown is None or self._shown.seq != seq:
                self._shown = Frame(self._drawing.image(touch, seq), t_ns, seq)
        return self._shown

    def _forget(self, now_ns: int) -> None:
        """Drop exposures that a newer one has replaced."""
        while len(self._exposed) > 1 and self._exposed[1].t_ns + LATENCY_NS <= now_ns:
            self._exposed.popleft()


class MockDigit(MotionlessLife):
    """A `TactileSensor` on the plant."""

    def __init__(self, camera: CellCamera, spec: SensorSpec) -> None:
        self._camera = camera
        self._spec = spec
        self._guard = LifecycleGuard(NAME)

    @property
    def spec(self) -> SensorSpec:
        """Image size, rate and scale; a gel without markers."""
        return self._spec

    def connect(self) -> None:
        """Start to expose."""
        with self._guard.connecting():
            self._camera.open()

    def close(self) -> None:
        """End exposing."""
        with self._guard.closing() as first:
            if first:
                self._camera.close()

    def read(self) -> Frame:
        """Return the newest frame. Raises StaleData before the first one."""
        self._guard.require_readable()
        frame = self._camera.newest()
        if frame is None:
            raise StaleData(NAME, "no frame has arrived yet", remedy="read again after the first exposure")
        return frame


def build(options: MockOptions, context: BuildContext) -> MockDigit:
    """Return the sensor in the simulated cell."""
    spec = options.spec()
    return MockDigit(CellCamera(join(context), context.clock, spec, context.rng_seed(NAME)), spec)
