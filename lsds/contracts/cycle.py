"""What passes along the engine's line: what a finger saw, what a controller decides on, what one step came to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds.contracts.values import (
        Detection,
        Frame,
        MarkerTracks,
        Observation,
        PoseSample,
        SlipEstimate,
        Twist,
    )


@dataclass(frozen=True, slots=True, eq=False)
class FingerCycle:
    """One finger's newest frame and what was made of it, in that sensor's own plane.

    An `opposite` finger looks at the object from the other side: its x and its sense of turning are mirrored.
    """

    finger: str
    frame: Frame
    tracks: MarkerTracks
    observation: Observation
    detection: Detection
    estimate: SlipEstimate
    opposite: bool = False


@dataclass(frozen=True, slots=True)
class GripInput:
    """What a controller decides on: slip state now, and the aperture that was last really commanded.

    `detection` and `estimate` rest on all fingers; `fingers` has what each of them saw last. `dt_s` is the measured
    time since the frame before, of the finger that came first.
    """

    t_ns: int
    dt_s: float
    detection: Detection
    estimate: SlipEstimate
    aperture_m: float
    measured_aperture_m: float
    fingers: tuple[FingerCycle, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
    """One step from camera to gripper, at `t_ns` of the rig's clock.

    `fingers` are those with a new frame, in the rig's order; `detection` and `estimate` rest on all fingers, in the
    plane of the first. `command_m` is the aperture that was sent, None where nothing was; `held_m` the one last sent;
    `measured_m` the gripper's own. `acting` is true while the controller answers slip; `twist` is what the job wants of
    the arm, None where it leaves it alone.
    """

    t_ns: int
    stage: str
    acting: bool
    fingers: tuple[FingerCycle, ...]
    detection: Detection
    estimate: SlipEstimate
    command_m: float | None
    held_m: float
    measured_m: float
    pose: PoseSample | None = None
    twist: Twist | None = None

    @property
    def frame(self) -> Frame:
        """The first finger's frame."""
        return self.fingers[0].frame

    @property
    def tracks(self) -> MarkerTracks:
        """The first finger's tracks."""
        return self.fingers[0].tracks

    @property
    def observation(self) -> Observation:
        """The first finger's observation."""
        return self.fingers[0].observation
