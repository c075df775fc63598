"""Options of `[gripper.franka-hand]` and `[gripper.mock-franka-hand]`."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class DriverOptions(BaseModel):
    """Time limits and homing, the same for the hand and its fake."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    stale_after_ms: float = Field(default=500.0, ge=50, le=5000, description="age at which the newest state is stale")
    interrupt_limit_s: float = Field(
        default=0.5, gt=0, le=10, description="time after a stop in which the command that runs must end"
    )
    home: bool = Field(
        default=False, description="home a hand without a known width when it is armed: it opens and closes fully"
    )


class Options(DriverOptions):
    """Address of the robot."""

    host: str = Field(min_length=1, description="address of the robot's controller")


class MockOptions(DriverOptions):
    """The fake."""

    object_mm: float = Field(default=0.0, ge=0, le=80, description="width of an object between the fingers; 0: none")
