"""Options of the study `optics`."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class OpticsOptions(BaseModel):
    """Measure computing time of a simulated finger's frame, mechanics and image, and its colour error.

    Takes: 20 s.

    \b
    Examples:
      lsds study optics
      lsds study optics --scene sphere --tolerance-um 5 --json optics.json
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    scenes: list[str] = Field(
        default_factory=list,
        description="scene to measure; repeatable; default: all",
        json_schema_extra={"flag": "--scene", "metavar": "NAME"},
    )
    fidelity: Literal["auto", "pad"] = Field(
        default="auto", description="gel model: automatic grid, or a fixed grid of 0.48 mm cells"
    )
    tolerance_um: float = Field(
        default=20.0, ge=0.5, le=200, description="error tolerance of the gel with automatic grid, um"
    )
    repeats: int = Field(default=3, ge=1, le=100, description="runs of each; figures are over the frames of all runs")
