"""The result of one cycle of the engine."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from lsds.contracts.brief import brief
from lsds.contracts.grip import GripEstimate

if TYPE_CHECKING:
    from lsds.contracts.finger import FingerCycle
    from lsds.contracts.values import (
        Detection,
        Frame,
        MarkerTracks,
        Observation,
        PoseSample,
        SlipEstimate,
        Twist,
    )


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Cycle:
    """One cycle from camera to gripper, at `t_ns` of the rig's clock.

    `fingers` are those with a new frame, in the rig's order; `detection` and `estimate` are fused over all fingers, in
    the plane of the first. `command_m` is the aperture sent in this cycle, None if nothing was sent; `held_m` the one
    last sent; `measured_m` the one reported by the gripper. `acting` is true while the controller corrects slip;
    `grip` is the estimate of the grip, as the controller got it.
    `twist` is the TCP velocity that the job wants, None if it does not use the arm. `leads` is true if the first
    finger of `fingers` is the first of the rig.
    """

    __repr__ = brief

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
    grip: GripEstimate = field(default_factory=GripEstimate)

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
