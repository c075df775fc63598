"""Options of the `[tactile]` table: how images become a field and features."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class TactileOptions(BaseModel):
    """Options from image to features. Lengths are in millimetres here, since users type them; in metres elsewhere."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    mm_per_px: float | None = Field(
        default=None, gt=0, le=1, description="scale of the image; the sensor's own where not given"
    )
    reference_frames: int = Field(
        default=5, ge=1, le=500, description="untouched frames averaged into the reference frame"
    )
    contact_threshold_mm: float = Field(default=0.05, gt=0, le=5, description="depth that counts as contact")
    shear_kpa_mm: float = Field(
        default=27.2,
        gt=0,
        le=1000,
        description="shear traction of the gel over its displacement; lsds calibrate grip finds that of your own",
    )
    depth_scale: Literal[2, 4, 8, 16] = Field(default=8, description="depth is solved at 1/depth_scale of the image")
    budget_ms: float | None = Field(
        default=None,
        gt=0,
        le=1000,
        description="mean time of a frame in which nothing moves, from image to command: as far as it needs, such "
        "frames are reduced to the markers; not given: every frame is evaluated in full",
    )
    budget_scale: float = Field(
        default=1.0, gt=0, le=100, description="computing time of this machine over that of docs/speed.md"
    )
    arithmetic: Literal["auto", "compiled", "portable"] = Field(
        default="auto",
        description="inner loops compiled by numba (extra fast) or in OpenCV and NumPy; auto: compiled if installed",
    )
