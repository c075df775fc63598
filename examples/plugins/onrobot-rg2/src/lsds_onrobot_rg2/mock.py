"""The gripper in the simulated cell: the driver on the registers of a mock, whose fingers are the plant's."""

from __future__ import annotations

from lsds.clock import Clock
from lsds.contracts import BuildContext
from lsds.contracts.plant import Action, Motion, Plant, join
from lsds.contracts.plant_links import FingerState

from lsds_onrobot_rg2.device import Rg2Device
from lsds_onrobot_rg2.gripper import Rg2Gripper
from lsds_onrobot_rg2.options import MockOptions
from lsds_onrobot_rg2.pump import Pump

NAME = "mock-onrobot-rg2"


class PlantFingers:
    """A `FingerLink` on the plant of this process. Within a step of the plant, time is that of the step."""

    def __init__(self, plant: Plant, clock: Clock) -> None:
        self._plant = plant
        self._clock = clock
        self._motion: Motion | None = None
        self._step_ns = 0

    def now(self) -> int:
        """Return the time of the step under way, else that of the clock."""
        return self._step_ns if self._motion is not None else self._clock.now()

    def sleep_until(self, t_ns: int) -> None:
        """Wait by the clock."""
        self._clock.sleep_until(t_ns)

    def within(self, t_ns: int, motion: Motion | None) -> None:
        """Enter a step of the plant, or leave it (None)."""
        self._step_ns, self._motion = t_ns, motion

    def drive(self, target_m: float, speed_m_s: float, limit_n: float) -> None:
        """Move to an aperture."""
        self._do(lambda motion: motion.drive_fingers(target_m, speed_m_s, limit_n))

    def hold(self) -> None:
        """Stay at the present aperture."""
        self._do(lambda motion: motion.hold_fingers())

    def fingers(self) -> FingerState:
        """Return the newest state."""
        at = self._plant.moment(self.now())
        return FingerState(at.t_ns, at.aperture_m, at.target_m, at.moving, at.stalled, at.normal_n)

    def close(self) -> None:
        """Nothing to release."""

    def _do(self, action: Action) -> None:
        if self._motion is not None:
            action(self._motion)
        else:
            self._plant.post(self._clock.now(), NAME, action)


class DeviceBus:
    """A `Bus` to a mock in this process."""

    def __init__(self, device: Rg2Device) -> None:
        self._device = device

    def open(self) -> None:
        """Nothing to open."""

    def close(self) -> None:
        """Nothing to release."""

    def read(self, address: int, count: int) -> list[int]:
        """Return the values of registers."""
        return [self._device.read(address + i) or 0 for i in range(count)]

    def write(self, address: int, words: list[int]) -> None:
        """Write registers in their order."""
        for i, word in enumerate(words):
            assert self._device.accepts(address + i, word), f"the driver wrote {word} to register {address + i}"
            self._device.write(address + i, word)


class PlantTicker:
    """A `Ticker` of the plant: each step posts the next one."""

    def __init__(self, plant: Plant, clock: Clock, fingers: PlantFingers, rate_hz: float) -> None:
        self._plant = plant
        self._clock = clock
        self._fingers = fingers
        self._period_ns = round(1e9 / rate_hz)
        self._pump: Pump | None = None

    def start(self, pump: Pump) -> None:
        """Post the first step."""
        self._pump = pump
        self._post(self._clock.now() + self._period_ns)

    def catch_up(self) -> None:
        """Advance the plant to now, with all steps that are due."""
        self._plant.advance(self._clock.now())

    def stop(self) -> None:
        """Do the steps that are due, and no more."""
        if self._pump is not None:
            self.catch_up()
        self._pump = None

    def _post(self, t_ns: int) -> None:
        def step(motion: Motion) -> None:
            if self._pump is None:
                return
            self._fingers.within(t_ns, motion)
            try:
                self._pump.step(t_ns)
            finally:
                self._fingers.within(t_ns, None)
            self._post(t_ns + self._period_ns)

        self._plant.post(t_ns, NAME, step)


def build(options: MockOptions, context: BuildContext) -> Rg2Gripper:
    """Return the driver on the simulated cell."""
    plant = join(context)
    fingers = context.shared(f"fingers of {NAME}", lambda: PlantFingers(plant, context.clock))
    # A second driver of the same cell drives the same device.
    device = context.shared(f"device of {NAME}", lambda: Rg2Device(fingers, fingers))
    ticker = PlantTicker(plant, context.clock, fingers, options.poll_hz)
    return Rg2Gripper(NAME, DeviceBus(device), ticker, options, context.clock)
