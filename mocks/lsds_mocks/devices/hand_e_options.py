"""Options of the mock Hand-E."""

from __future__ import annotations

from typing import Self

from pydantic import BaseModel, ConfigDict, Field, model_validator


class HandEOptions(BaseModel):
    """Options of `[gripper.mock-hand-e]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    stroke_mm: float = Field(
        default=50.0, gt=0, le=200, description="stroke of both fingers together, between open_tick and closed_tick"
    )
    open_tick: int = Field(default=3, ge=0, le=254, description="position register when fully open")
    closed_tick: int = Field(default=228, ge=1, le=255, description="position register when fully closed")
    latency_ms: float = Field(default=40.0, ge=0, le=1000, description="latency from command to motion")
    latency_jitter_ms: float = Field(default=3.0, ge=0, le=100, description="half width of the latency distribution")
    activated: bool = Field(default=True, description="start activated; otherwise arm() closes and opens the gripper")
    command_loss: float = Field(default=0.0, ge=0, le=1, description="fault: probability that a command is lost")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.closed_tick <= self.open_tick:
            raise ValueError("closed_tick must be above open_tick: 0 is open in the position register")
        return self
