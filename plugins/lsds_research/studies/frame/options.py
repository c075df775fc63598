"""Options of the study `frame`."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class FrameOptions(BaseModel):
    """Time one frame from image to command, part by part, and the trackers next to their peers.

    Takes: about a minute.

    \b
    Examples:
      lsds study frame
      lsds study frame --repeats 30 --json frame.json --csv frame.csv \\
          --plot frame.png
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    repeats: int = Field(default=10, ge=1, description="number of passes over the frames")
    seed: int = Field(default=0, ge=0, description="seed of the simulated run")
