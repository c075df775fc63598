"""Small faults that keep their contract, one around each kind of part; the mutants are these with one mistake each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts.stages import START, shared_stages
from lsds.errors import DeviceTimeout


class Options(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    severity: int = Field(default=3, ge=1, le=5)
    at: str = Field(default=START)


class Around:
    """A part that passes on all other attributes."""

    def __init__(self, part, fault):
        self.part, self.fault = part, fault

    def __getattr__(self, name):
        return getattr(self.part, name)


class HonestFault:
    """When it is on, by stage and seed."""

    target = "gripper"
    wrapper = Around

    def __init__(self, options, context):
        self.options, self.context = options, context
        self.moment = options.at
        self.restart()

    def restart(self):
        self.rng = np.random.default_rng(self.context.rng_seed("honest"))

    @property
    def on(self):
        return shared_stages(self.context).began_ns(self.moment) is not None

    def around(self, part):
        return self.wrapper(part, self)


class Offset(Around):
    """Scatters the aperture that a gripper reports."""

    def read(self):
        state = self.part.read()
        if not self.fault.on:
            return state
        error_m = 1e-4 * self.fault.options.severity * (1 + self.fault.rng.random())
        return replace(state, aperture_m=state.aperture_m + error_m)


class OffsetFault(HonestFault):
    wrapper = Offset


class Dim(Around):
    """Darkens the frames of a camera."""

    def read(self):
        frame = self.part.read()
        return replace(frame, image=frame.image // 2) if self.fault.on else frame


class DimFault(HonestFault):
    target = "sensor"
    wrapper = Dim


class Late(Around):
    """Gives the answer before, or a confident denial."""

    def __init__(self, part, fault):
        super().__init__(part, fault)
        self.last = None

    def reset(self):
        self.part.reset()
        self.fault.restart()
        self.last = None

    def update(self, observation):
        answer = self.part.update(observation)
        late, self.last = self.last or answer, answer
        return replace(late, confidence=float(self.fault.rng.random())) if self.fault.on else answer


class LateFault(HonestFault):
    target = "detector"
    wrapper = Late


class Gone(Around):
    """An arm that does not answer."""

    def read(self):
        if self.fault.on:
            raise DeviceTimeout("arm", "it does not answer", remedy="check its network")
        return self.part.read()


class GoneFault(HonestFault):
    target = "arm"
    wrapper = Gone


class ObserverFault(HonestFault):
    target = "observer"

    def around(self, part):
        def observe(cycle):
            if self.on:
                raise OSError("disk full")

        return observe


HONEST_FAULTS = (OffsetFault, DimFault, LateFault, GoneFault, ObserverFault)
