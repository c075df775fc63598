"""Options of the mock UR5e."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class UR5eOptions(BaseModel):
    """Options of `[arm.mock-ur5e]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    latency_ms: float = Field(
        default=4.0, ge=0, le=500, description="latency from command to motion; 3.5-4 ms measured by RTDE"
    )
    latency_jitter_ms: float = Field(default=1.0, ge=0, le=100, description="half width of the latency distribution")
    speed_limit_m_s: float = Field(default=1.0, gt=0, le=5, description="maximum TCP speed")
    acceleration_limit_m_s2: float = Field(default=2.5, gt=0, le=150, description="maximum TCP acceleration")
    stop_acceleration_m_s2: float = Field(
        default=2.5, gt=0, le=150, description="deceleration on stop and on command expiry"
    )
    protective_stop_on_excess: bool = Field(
        default=False, description="fault: a command beyond the limits stops the arm instead of being clamped"
    )
    command_loss: float = Field(default=0.0, ge=0, le=1, description="fault: probability that a command is lost")
