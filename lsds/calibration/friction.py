"""Calibration of friction: move the fingers along a fixed object; compare the load before and during the slide."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from statistics import median
from typing import TYPE_CHECKING, Any

from lsds.config.own import own_section
from lsds.config.toml import dumps
from lsds.errors import ConfigError, ConfigIssue, DataError
from lsds.runtime.engine import Engine
from lsds.runtime.rig import Rig
from lsds.tactile.carried_load import LEAST_EVIDENCE_N, CarriedLoad

if TYPE_CHECKING:
    from collections.abc import Callable

    from lsds.config import RigConfig

LEAST_SLIDE_FRAMES = 20
"""Minimum number of frames of the slide."""
BEFORE = "settle"
"""Stage of the job `slide` without tangential load."""
SLIDING = "slide"
"""Stage of the job `slide` in which the fingers move along the object."""
GIVEN_WAY = 0.98
"""Maximum load at the end of the slide as a share of the maximum load; above it the object has not slid."""
_HEAD = """\
# Written by `lsds calibrate grip --slide`. Name it in the config: calibration = ["this file"]
# The load was {static_n:.3g} N a finger when the object gave way, and {kinetic_n:.3g} N while it slid; {frames} frames.

"""


@dataclass(frozen=True, slots=True)
class FrictionCalibration:
    """Load per finger (N) at the start of slip and during it, and their ratio: static over kinetic friction."""

    static_n: float
    kinetic_n: float
    frames: int

    @property
    def ratio(self) -> float:
        """Static over kinetic friction."""
        return max(1.0, self.static_n / self.kinetic_n)

    def as_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {**asdict(self), "kinetic": self.ratio}

    def toml(self) -> str:
        """Return the text of the file that a config names."""
        return _HEAD.format(**asdict(self)) + dumps({"grip": {"kinetic": round(self.ratio, 3)}})


def slid_friction(config: RigConfig, say: Callable[[str], object]) -> FrictionCalibration:
    """Run the rig's job `slide` and return friction from the load.

    Raises ConfigError without gripper and arm, DataError if the object did not slide, and any error that ends a run.
    """
    load, loads = CarriedLoad(), list[float]()
    with Rig(config.model_copy(update={"job": own_section("slide")})) as rig:
        if rig.gripper is None or rig.arm is None:
            issue = ConfigIssue("gripper.backend, arm.backend", "the fingers have to move along it", "choose both")
            raise ConfigError("the rig", [issue])
        say("moving the fingers along the object")
        rig.arm_devices()
        for cycle in Engine(rig):
            if cycle.stage in (BEFORE, SLIDING):
                load.take(cycle.frame.t_ns, cycle.fingers)
            if cycle.stage == SLIDING and math.isfinite(load.now_n):
                loads.append(load.now_n)
    return _compared(loads)


def _compared(loads: list[float]) -> FrictionCalibration:
    """Return the maximum load and the median of the second half. Raises DataError if the object did not slide."""
    if len(loads) < LEAST_SLIDE_FRAMES:
        raise DataError(
            f"only {len(loads)} frames of the slide showed a load (raise job.slide.slide_s; does the object touch the "
            "dots?)"
        )
    smooth = [median(loads[at - 1 : at + 2]) for at in range(1, len(loads) - 1)]
    static_n, kinetic_n = max(smooth), median(smooth[len(smooth) // 2 :])
    if static_n < LEAST_EVIDENCE_N:
        raise DataError("the load stays zero: the object moves with the fingers (does it stand, or is it clamped?)")
    if kinetic_n > GIVEN_WAY * static_n:
        raise DataError(
            "the load never gave way: nothing slid (grip less firmly: lower task.first_squeeze_m; or slide farther: "
            "raise job.slide.slide_s)"
        )
    return FrictionCalibration(static_n, kinetic_n, len(loads))
