"""Options of the `[tactile]` table: how images become a field and features."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

FeatureSet = Literal["baseline", "proposed", "combined", "released13", "all"]


class TactileOptions(BaseModel):
    """From image to features. Lengths in millimetres here, because people type them; metres everywhere inside."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    mm_per_px: float | None = Field(
        default=None, gt=0, le=1, description="scale of the image; the sensor's own where not given"
    )
    reference_frames: int = Field(
        default=5, ge=1, le=500, description="untouched frames averaged into the reference frame"
    )
    feature_set: FeatureSet = Field(default="combined", description="which named set detectors and estimators see")
    contact_threshold_mm: float = Field(default=0.05, gt=0, le=5, description="depth that counts as contact")
    depth_scale: int = Field(default=8, ge=1, le=16, description="depth is solved at 1/depth_scale of the image")
