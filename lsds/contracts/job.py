"""Contract of a job: the task of a run.

A job states what it wants of arm and grip now, and when it is done. Limits, freshness, watchdog, command expiry and the
check that the arm follows are handled by the engine, in the same way for every job.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from lsds.contracts.cycle import Cycle
    from lsds.contracts.devices import Cell
    from lsds.contracts.finger import FingerCycle
    from lsds.contracts.task import TaskOptions
    from lsds.contracts.values import ArmSpec, ArmState, GripperSpec, GripperState, PoseSample, Slide, Twist


TOUCH_STD_M = 1e-3
"""Standard deviation of an aperture at touch that was found while the fingers moved fast, m; chosen: at the 50 mm/s of
a grasp a touch was noticed 1.1 mm too late (simulated)."""


@dataclass(frozen=True, slots=True)
class Grip:
    """Go to an aperture (m) at a finger speed (m/s), pushing with at most a force (N). A job's grip may open."""

    aperture_m: float
    speed_m_s: float
    force_n: float


@dataclass(frozen=True, slots=True)
class Wanted:
    """The present wishes of a job. They are a state, not an event: the engine acts on changes.

    `stage` names the stage of the job, for messages and recordings. `grip` is the wanted grip, None leaves the fingers
    as they are; a command that the gripper did not receive is sent again. `corrects` lets the controller correct slip
    by closing the grip further. `twist` is the velocity of the TCP, streamed with `acceleration_m_s2`
    (m/s^2) for as long as it is wanted; None leaves the arm alone, which another program may control. `touch_m` is the
    aperture at which the fingers touched the object, for the controller; NaN if not known. `touch_std_m` is its
    standard deviation. `probes` lets the controller open on purpose, to find the least grip: the object falls by little
    now. `slide` is a slip that is wanted and not to be corrected, None if none is. `supported`: the object may still
    stand on its support. `done` ends the run.
    """

    stage: str
    grip: Grip | None = None
    corrects: bool = False
    twist: Twist | None = None
    acceleration_m_s2: float = 0.5
    done: bool = False
    touch_m: float = math.nan
    touch_std_m: float = TOUCH_STD_M
    probes: bool = False
    slide: Slide | None = None
    supported: bool = False


@dataclass(frozen=True, slots=True)
class Setting:
    """The input of a job's `begin`, at `t_ns`: the `[task]` table, and the specs of gripper and arm (None if absent).

    `cell` is the simulated cell of the sensors, None for a real one; a job may read the truth from it. `fingers` are
    the names of the rig's; `apertures_m` the least and greatest aperture that gripper and `[safety]` allow.
    """

    t_ns: int
    task: TaskOptions
    gripper: GripperSpec | None = None
    arm: ArmSpec | None = None
    cell: Cell | None = None
    fingers: tuple[str, ...] = ()
    apertures_m: tuple[float, float] = (0.0, math.inf)


@dataclass(frozen=True, slots=True)
class Situation:
    """The input of a job's `step`, at `t_ns`.

    `referenced`: every finger has a reference image of its gel without contact. `arrived`: the fingers rest at the last
    wanted grip, or on an object on the way there; true without a gripper. `cycle` is the newest cycle; `fingers` what
    each finger saw last, in the rig's order; the states are the newest that were read, None before the first.
    """

    t_ns: int
    referenced: bool = False
    arrived: bool = False
    cycle: Cycle | None = None
    gripper: GripperState | None = None
    arm: ArmState | None = None
    pose: PoseSample | None = None
    fingers: tuple[FingerCycle, ...] = ()


@runtime_checkable
class Job(Protocol):
    """The interface of a backend of kind `job`. It does no I/O, reads no clock and holds no device.

    A job may have an attribute `stages`, a tuple of the names of all its stages: a fault that is to begin with a stage
    that does not exist is then refused before anything moves.
    """

    def begin(self, setting: Setting) -> None:
        """Start a new run and clear all state. Raises ConfigError if the rig lacks what the job needs."""
        ...

    def step(self, now: Situation) -> Wanted:
        """Return the wanted state now; called at `schedule.arm_rate_hz`. Raises SafetyStop to end the run as a
        fault."""
        ...
