"""The `[task]` table: parameters of gripping and lifting."""

from __future__ import annotations

from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator


class TaskOptions(BaseModel):
    """Parameters of gripping and lifting. The default is the paper's demonstration: lift a PVC pipe at 3.8 cm/s."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    grasp: Literal["touch", "aperture"] = Field(
        default="touch",
        description="how to close on the object: until the gel touches it, or to an aperture; "
        "a table that gives grip_aperture_m and not this means the aperture",
    )
    grip_aperture_m: float = Field(default=0.0236, ge=0, le=0.5, description="aperture of a grasp to an aperture")
    approach_speed_m_s: float = Field(default=0.02, gt=0, le=1, description="finger speed until the first touch")
    touch_speed_m_s: float = Field(
        default=0.006, gt=0, le=0.1, description="finger speed, tick by tick, of the touch that counts"
    )
    first_squeeze_m: float = Field(default=1e-3, gt=0, le=0.05, description="how far to close beyond the touch")
    take_up_speed_m_s: float = Field(
        default=0.01,
        gt=0,
        le=1,
        description="lifting speed after a grasp by touch, until the object hangs",
    )
    probe: bool = Field(
        default=False,
        description="after a grasp by touch: take up the load, open carefully until the object begins to slip, and "
        "lift with what that shows to be needed",
    )
    fragile_n: float | None = Field(
        default=None,
        gt=0,
        le=500,
        description="greatest normal force a finger that the object stands; a hard one may get a tick's worth more",
    )
    max_slip_m: float = Field(
        default=0.03, gt=0, le=1, description="a longer true slip of a simulated object counts as slipped too far"
    )
    max_grip_ratio: float = Field(
        default=5.0,
        gt=1,
        le=1000,
        description="a simulated object without fragile_n counts as crushed by a grip above this multiple of the grip "
        "that it needs, or of the first grip if that is firmer",
    )
    grip_speed_m_s: float = Field(default=0.05, gt=0, le=1, description="finger speed of grasping and correcting")
    grip_force_n: float = Field(default=60.0, gt=0, le=500, description="maximum force of the gripper")
    lift_speed_m_s: float = Field(default=0.038, ge=0, le=1, description="vertical TCP velocity while lifting")
    lift_acceleration_m_s2: float = Field(
        default=0.5, gt=0, le=20, description="acceleration at the start and end of the lift"
    )
    settle_s: float = Field(default=0.6, ge=0, le=60, description="settling time between grasp and lift")
    lift_s: float = Field(default=3.0, ge=0, le=600, description="duration of the lift")
    hold_s: float = Field(default=1.0, ge=0, le=600, description="duration of holding still after the lift")
    timeout_s: float = Field(
        default=10.0, gt=0, le=600, description="time limit of taking the reference and of the grasp"
    )

    @model_validator(mode="after")
    def _what_is_fragile_is_touched(self) -> Self:
        if self.fragile_n is not None and self.grasp != "touch":
            raise ValueError('fragile_n needs grasp = "touch": a grasp to an aperture does not measure the force')
        return self

    @model_validator(mode="before")
    @classmethod
    def _a_given_aperture_implies_its_grasp(cls, data: Any) -> Any:
        if isinstance(data, dict) and "grip_aperture_m" in data and "grasp" not in data:
            return {**data, "grasp": "aperture"}
        return data
