"""Contract of a job: what a run is for.

A job says what it wants of arm and grip now, and when it is done. Whatever keeps the cell safe (limits, freshness,
watchdog, expiry, the watch over an arm that does not follow) is the engine's, the same for every job.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from lsds.contracts.cycle import Cycle
    from lsds.contracts.devices import Cell
    from lsds.contracts.values import ArmSpec, ArmState, GripperSpec, GripperState, PoseSample, Twist
    from lsds.task import TaskOptions


@dataclass(frozen=True, slots=True)
class Grip:
    """Go to an aperture (m) at a finger speed (m/s), pushing with at most a force (N). A job's grip may open."""

    aperture_m: float
    speed_m_s: float
    force_n: float


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a job wants now. It is a state, not an event: the engine acts on what differs from before.

    `stage` names where the job is, for messages and recordings. `grip` is where the fingers shall go, None leaves them
    as they are; a command that the gripper did not take is sent again. `corrects` lets the controller answer slip,
    which closes the grip from what is held. `twist` is the velocity of the TCP, streamed with `acceleration_m_s2`
    (m/s^2) for as long as it is wanted; None leaves the arm alone, for it may be somebody else's. `done` ends the run.
    """

    stage: str
    grip: Grip | None = None
    corrects: bool = False
    twist: Twist | None = None
    acceleration_m_s2: float = 0.5
    done: bool = False


@dataclass(frozen=True, slots=True)
class Setting:
    """What a job finds when it begins, at `t_ns`: the `[task]` table, what gripper and arm can do (None for none).

    `cell` is the simulated cell that the sensors live in, None for a real one; a job may ask it for the truth.
    """

    t_ns: int
    task: TaskOptions
    gripper: GripperSpec | None = None
    arm: ArmSpec | None = None
    cell: Cell | None = None


@dataclass(frozen=True, slots=True)
class Situation:
    """What a job knows at `t_ns`.

    `referenced`: every finger has the image of its untouched gel. `arrived`: the fingers rest where the last wanted
    grip sent them, or on an object on the way there; without a gripper it is true. `cycle` is the newest frame with
    all that was made of it; the states are the newest that were read, None before the first.
    """

    t_ns: int
    referenced: bool = False
    arrived: bool = False
    cycle: Cycle | None = None
    gripper: GripperState | None = None
    arm: ArmState | None = None
    pose: PoseSample | None = None


@runtime_checkable
class Job(Protocol):
    """What a backend of kind `job` is. It does no I/O, reads no clock and keeps no device."""

    def begin(self, setting: Setting) -> None:
        """Begin anew, and forget any run before. Raises ConfigError where the rig lacks what the job needs."""
        ...

    def step(self, now: Situation) -> Wanted:
        """Return what is wanted now; called at `schedule.arm_rate_hz`. Raises SafetyStop to end the run as a fault."""
        ...
