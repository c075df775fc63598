"""The job of a run: grasp, lift, hold. Says where gripper and arm should be going at any time."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class TaskOptions(BaseModel):
    """Options of the `[task]` table. The default is the paper's demonstration: lift a PVC pipe at 3.8 cm/s."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    grip_aperture_m: float = Field(default=0.0243, ge=0, le=0.5, description="aperture to grasp with")
    grip_speed_m_s: float = Field(default=0.05, gt=0, le=1)
    grip_force_n: float = Field(default=60.0, gt=0, le=500, description="most that the gripper may push with")
    lift_speed_m_s: float = Field(default=0.038, ge=0, le=1, description="vertical TCP velocity while lifting")
    lift_acceleration_m_s2: float = Field(default=0.5, gt=0, le=20)
    settle_s: float = Field(default=0.6, ge=0, le=60, description="wait between grasp and lift")
    lift_s: float = Field(default=3.0, ge=0, le=600, description="how long to lift")
    hold_s: float = Field(default=1.0, ge=0, le=600, description="how long to hold still afterwards")
