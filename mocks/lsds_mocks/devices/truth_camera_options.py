"""Options of the simulated ground-truth camera."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class TruthCameraOptions(BaseModel):
    """Options of `[pose_source.mock-truth-camera]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    width: int = Field(default=640, ge=160, le=3840, description="width in px")
    height: int = Field(default=480, ge=120, le=2160, description="height in px")
    rate_hz: float = Field(default=60.0, gt=0.5, le=240, description="frame rate")
    exposure_ms: float = Field(default=4.0, ge=0, le=16, description="exposure time, which causes motion blur")
    latency_ms: float = Field(
        default=20.0, ge=10, le=500, description="latency from the middle of exposure to a readable pose"
    )
    noise: float = Field(default=1.0, ge=0, le=20, description="camera noise, 1 = sigma 1.6 grey levels")
    stale_after_ms: float = Field(default=500.0, gt=0, description="age above which a sample is StaleData")
