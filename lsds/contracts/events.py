"""The events of an engine, in order: its inputs and its commands, as a recording keeps them and a replay needs them.

Everything that the algorithms' results depend on is an event: frames, states of devices, the job's wishes, and what
the gripper accepted. A `Cycle` is published as an event too, after those that it depends on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds.contracts.cycle import Cycle
    from lsds.contracts.job import Wanted
    from lsds.contracts.values import ArmState, CellTruth, Frame, GripperState, PoseSample


@dataclass(frozen=True, slots=True)
class FramesRead:
    """New frames of one poll, by finger; `depends`: an object or a moving arm depends on them."""

    now_ns: int
    frames: tuple[tuple[str, Frame], ...]
    depends: bool


@dataclass(frozen=True, slots=True)
class GripperRead:
    """A new state of the gripper."""

    now_ns: int
    state: GripperState


@dataclass(frozen=True, slots=True)
class ArmRead:
    """A new state of the arm."""

    now_ns: int
    state: ArmState


@dataclass(frozen=True, slots=True)
class PosesRead:
    """A new answer of the pose source: poses, or the reason for their absence."""

    now_ns: int
    sample: PoseSample | None
    problem: str


@dataclass(frozen=True, slots=True)
class JobStepped:
    """A job's new wishes; `sent`: a grip was sent for them; `held_m`: the aperture last sent, NaN before the first."""

    now_ns: int
    wanted: Wanted
    sent: bool
    held_m: float


@dataclass(frozen=True, slots=True)
class Corrected:
    """A correction of the grip: the aperture that the controller wanted, and what was sent, None for nothing."""

    now_ns: int
    wanted_m: float
    sent_m: float | None


@dataclass(frozen=True, slots=True)
class TruthKnown:
    """The true state of a simulated cell."""

    now_ns: int
    truth: CellTruth


Event = FramesRead | GripperRead | ArmRead | PosesRead | JobStepped | Corrected | TruthKnown
"""An event other than a cycle."""

if TYPE_CHECKING:
    Published = Event | Cycle
