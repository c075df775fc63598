"""Calibration of load: lift an object of known weight, and compare the markers' displacement with it."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from statistics import fmean, stdev
from typing import TYPE_CHECKING, Any

from lsds.calibration.answer import AnswerTimer
from lsds.config.own import own_section
from lsds.config.toml import dumps
from lsds.errors import ConfigError, ConfigIssue, DataError
from lsds.grip.options import GripOptions
from lsds.runtime.engine import Engine
from lsds.runtime.rig import Rig

if TYPE_CHECKING:
    from collections.abc import Callable

    from lsds.config import RigConfig
    from lsds.contracts import ContactLoad, Cycle

BEFORE = "settle"
"""Stage of the job `lift` without tangential load."""
CARRIED = "hold"
"""Stage of the job `lift` in which the object hangs still."""
FINGERS = 2
"""Number of fingers that carry the weight, with or without sensors."""
LEAST_STAGE_FRAMES = 10
"""Minimum number of frames of a stage."""
STEADY_LOAD_STD = 0.1
"""Maximum relative standard deviation of the load while the object hangs still."""
LEAST_RATIO = 5.0
"""Minimum ratio of the load to the scatter of the gel at rest."""
_HEAD = """\
# Written by `lsds calibrate grip`. Name it in the config: calibration = ["this file"]
# {weight:.3g} N hung in the grip; {frames} frames; from object to object it differs by some 12 %.

"""


@dataclass(frozen=True, slots=True)
class GripCalibration:
    """Shear stiffness of the gel (kPa/mm) before and after the calibration, with the measurements behind it.

    `shares` is the share of the weight that each finger with a sensor carried, by the new stiffness. `noise` is the
    load's relative standard deviation while the object hung. `answer_s` is the delay of the fingers, NaN if the gripper
    never moved from rest.
    """

    weight_n: float
    shear_kpa_mm: float
    shear_std_kpa_mm: float
    before_kpa_mm: float
    shares: dict[str, float]
    frames: int
    noise: float
    answer_s: float = math.nan

    def as_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        return asdict(self)

    def toml(self) -> str:
        """Return the text of the file that a config names."""
        grip = {} if math.isnan(self.answer_s) else {"answer_s": round(self.answer_s, 3)}
        if self.noise > GripOptions().noise:
            # A smaller scatter of one object does not show how loads differ between objects.
            grip["noise"] = round(self.noise, 3)
        found = {"tactile": {"shear_kpa_mm": round(self.shear_kpa_mm, 3)}, **({"grip": grip} if grip else {})}
        return _HEAD.format(weight=self.weight_n, frames=self.frames) + dumps(found)


def lifted_weight(config: RigConfig, weight_n: float | None, say: Callable[[str], object]) -> GripCalibration:
    """Run the rig's job `lift` and return the calibration from the load.

    `weight_n` is the weight of the object; a simulated cell knows its own. Raises ConfigError, DataError if the run
    shows too little, and any error that ends a run.
    """
    lifting = own_section("lift")
    loads: dict[str, dict[str, list[ContactLoad]]] = {BEFORE: {}, CARRIED: {}}
    true_n = list[float]()
    with Rig(config.model_copy(update={"job": lifting})) as rig:
        _require_what_lifts(rig, weight_n)
        say("lifting the object and holding it")
        rig.arm_devices()
        timer = AnswerTimer(rig.job)
        for cycle in Engine(rig, timer):
            timer.take(cycle)
            _take(cycle, loads)
            if rig.own_cell is not None and cycle.stage == CARRIED:
                true_n.append(FINGERS * rig.own_cell.truth().tangential_force_n)
        if rig.own_cell is not None and rig.own_cell.truth().dropped:
            raise DataError("the object dropped, so the load is unknown (raise task.first_squeeze_m)")
    if weight_n is None:
        weight_n = fmean(true_n) if true_n else math.nan
    interval_s = max(1 / finger.sensor.spec.rate_hz for finger in rig.fingers)
    found = _compared(loads, weight_n, config.tactile.shear_kpa_mm)
    return replace(found, answer_s=timer.answer(interval_s).whole_s)


def _require_what_lifts(rig: Rig, weight_n: float | None) -> None:
    """Raise ConfigError if the rig cannot lift, or if the weight is unknown."""
    if rig.gripper is None or rig.arm is None:
        issue = ConfigIssue("gripper.backend, arm.backend", "a weight has to be lifted", "choose both")
        raise ConfigError("the rig", [issue])
    if weight_n is None and rig.own_cell is None:
        issue = ConfigIssue("--mass-g", "the mass of the object is missing", "weigh the object and give its mass")
        raise ConfigError("the command", [issue])


def _take(cycle: Cycle, loads: dict[str, dict[str, list[ContactLoad]]]) -> None:
    for finger in cycle.fingers:
        load = finger.observation.load
        if cycle.stage in loads and load is not None:
            loads[cycle.stage].setdefault(finger.finger, []).append(load)


def _compared(loads: dict[str, dict[str, list[ContactLoad]]], weight_n: float, before_kpa_mm: float) -> GripCalibration:
    fingers = [name for name, seen in loads[CARRIED].items() if len(seen) >= LEAST_STAGE_FRAMES]
    fingers = [name for name in fingers if len(loads[BEFORE].get(name, ())) >= LEAST_STAGE_FRAMES]
    if not fingers:
        raise DataError(
            f"fewer than {LEAST_STAGE_FRAMES} frames showed the load before the lift or while the object hung (raise "
            "task.settle_s and task.hold_s; is the reference of the gel without contact?)"
        )
    # Two fingers carry the weight; a finger without a sensor carries half of it.
    carried_n = weight_n * min(len(fingers), FINGERS) / FINGERS
    forces = {name: _forces(loads[BEFORE][name], loads[CARRIED][name]) for name in fingers}
    count = min(map(len, forces.values()))
    sums = [sum(each[at] for each in forces.values()) for at in range(count)]
    still = sum(stdev(load.shear_n[1] for load in loads[BEFORE][name]) for name in fingers)
    if fmean(sums) < LEAST_RATIO * still or fmean(sums) <= 0:
        raise DataError("the gel shows no load while the object hangs (did it hang? take a heavier one)")
    noise = stdev(sums) / fmean(sums)
    if noise > STEADY_LOAD_STD:
        raise DataError(
            f"the load scatters by {noise:.0%} while the object hangs: did it slip or swing? "
            "(grip more firmly: raise task.first_squeeze_m)"
        )
    scale = carried_n / fmean(sums)
    shares = {name: fmean(each) * scale / weight_n for name, each in forces.items()}
    shear_kpa_mm = before_kpa_mm * scale
    return GripCalibration(weight_n, shear_kpa_mm, noise * shear_kpa_mm, before_kpa_mm, shares, count, noise)


def _forces(before: list[ContactLoad], carried: list[ContactLoad]) -> list[float]:
    """Return the force (N) in each carried frame, relative to the settled second half of the frames before."""
    settled = before[len(before) // 2 :]
    x, y = (fmean(load.shear_n[axis] for load in settled) for axis in (0, 1))
    return [math.hypot(load.shear_n[0] - x, load.shear_n[1] - y) for load in carried]
