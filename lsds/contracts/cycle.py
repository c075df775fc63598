"""Values passed through the engine: the view of a finger, the input of a controller, the result of one cycle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds.contracts.grip import GripEstimate
    from lsds.contracts.values import (
        Detection,
        Frame,
        MarkerTracks,
        Observation,
        PoseSample,
        Slide,
        SlipEstimate,
        Twist,
    )


@dataclass(frozen=True, slots=True, eq=False)
class FingerCycle:
    """One finger's newest frame and all that was computed from it, in that sensor's plane.

    An `opposite` finger faces the object from the other side: its x axis and its sense of rotation are mirrored.
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
    """The input of a controller: the present slip state, and the aperture last commanded.

    `detection` and `estimate` are fused over all fingers; `fingers` holds the newest view of each. `dt_s` is the
    measured time since the previous frame, of the finger that came first. `touch_m` is the aperture at which the
    fingers touched the object, NaN if the job did not tell. `measured_aperture_m` is the newest; `frame_aperture_m` is
    that at the time of the newest frame, which is older, NaN if not known. `probes`: the job lets it open on purpose,
    to find the least grip; `slide` is a slip that it wants, None if none is. `fragile_n` is the greatest normal force a
    finger that the object stands, `resolution_m` the gripper's tick. `grip` is what is known of the grip, None unless
    the controller declares `reads_grip`.
    """

    t_ns: int
    dt_s: float
    detection: Detection
    estimate: SlipEstimate
    aperture_m: float
    measured_aperture_m: float
    fingers: tuple[FingerCycle, ...] = ()
    touch_m: float = math.nan
    frame_aperture_m: float = math.nan
    probes: bool = False
    fragile_n: float = math.inf
    resolution_m: float = 0.0
    slide: Slide | None = None
    grip: GripEstimate | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
    """One cycle from camera to gripper, at `t_ns` of the rig's clock.

    `fingers` are those with a new frame, in the rig's order; `detection` and `estimate` are fused over all fingers, in
    the plane of the first. `command_m` is the aperture sent in this cycle, None if nothing was sent; `held_m` the one
    last sent; `measured_m` the one reported by the gripper. `acting` is true while the controller corrects slip;
    `grip` is what is known of the grip, as the controller got it.
    `twist` is the TCP velocity that the job wants, None if it does not use the arm. `leads` is true if the first
    finger of `fingers` is the first of the rig.
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
    leads: bool = True
    grip: GripEstimate | None = None

    @property
    def frame(self) -> Frame:
        """The frame of the first of `fingers`."""
        return self.fingers[0].frame

    @property
    def tracks(self) -> MarkerTracks:
        """The tracks of the first of `fingers`."""
        return self.fingers[0].tracks

    @property
    def observation(self) -> Observation:
        """The observation of the first of `fingers`."""
        return self.fingers[0].observation
