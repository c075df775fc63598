"""Options of the study `dynamics`."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class DynamicsOptions(BaseModel):
    """Measure integrators of dry friction where they fail: a grip is lost for a moment and regained.

    \b
    Examples:
      lsds study dynamics --csv dynamics.csv
      lsds study dynamics --step-ms 8 --step-ms 2
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    steps_ms: list[float] = Field(
        default=[40.0, 8.0, 2.0, 0.5],
        description="time step to measure, ms; repeatable",
        json_schema_extra={"flag": "--step-ms"},
    )
    reference_ms: float = Field(default=0.01, gt=0, description="time step of the reference solution, ms")
