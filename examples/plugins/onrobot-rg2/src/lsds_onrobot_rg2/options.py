"""Options of `[gripper.onrobot-rg2]` and `[gripper.mock-onrobot-rg2]`."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class MockOptions(BaseModel):
    """Timing of the driver, for the gripper in the simulated cell."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    poll_hz: float = Field(default=50.0, ge=5, le=200, description="rate at which the status is read")
    stale_after_ms: float = Field(default=300.0, ge=20, le=5000, description="age at which the newest status is stale")


class Options(MockOptions):
    """Address of the Compute Box, and timing."""

    host: str = Field(min_length=1, description="address of the Compute Box")
    port: int = Field(default=502, ge=1, le=65535, description="its Modbus TCP port")
    unit: int = Field(default=65, ge=1, le=247, description="Modbus unit: 65, or 66 and 67 on a dual quick changer")
    timeout_s: float = Field(default=0.05, gt=0, le=1, description="time allowed for an answer")
