"""Options of the `[grip]` table: what the belief about the grip assumes of gel, friction and load."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class GripOptions(BaseModel):
    """Parameters of the belief (`lsds.grip.belief`); `lsds calibrate grip` finds those that differ from cell to cell.

    The friction limit is limit * squeeze^power, in newtons a finger and millimetres.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    power: float = Field(
        default=1.1,
        ge=1,
        le=2,
        description="normal force of a long or flat contact grows with this power of the squeeze; round: 0.3 more",
    )
    kinetic: float = Field(default=1.2, ge=1, le=3, description="static over kinetic friction")
    noise: float = Field(default=0.1, gt=0, le=1, description="relative standard deviation of a measured load")
    drift: float = Field(
        default=0.1, gt=0, le=1, description="drift of load and limit, natural logarithm per square root of a second"
    )
    jumps_hz: float = Field(
        default=0.03,
        gt=0,
        le=1,
        description="how often the load jumps (a shove), and friction (a wet surface)",
    )
    limit: float = Field(default=0.5, gt=0, le=20, description="median of the limits of unknown objects, N/mm^power")
    spread: float = Field(
        default=1.1, gt=0, le=3, description="their standard deviation, natural logarithm: 1.1 is a factor of three"
    )
    stiffness_n_mm: float = Field(
        default=4.0, gt=0, le=100, description="greatest rise of the load a finger over the way of the arm"
    )
    answer_s: float | None = Field(
        default=None,
        gt=0,
        le=2,
        description="time from a change at the object to the fingers' answer; by the specs of sensor and gripper where "
        "not given",
    )
    unseen: float = Field(default=0.04, gt=0, lt=1, description="share of the slides that the detector does not see")
