"""Job `watch`: observe only; moves no device."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from lsds.clock import nanoseconds
from lsds.contracts import BuildContext, Setting, Situation, Wanted


class WatchOptions(BaseModel):
    """Options of `[job.watch]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    duration_s: float = Field(default=0.0, ge=0, le=1e6, description="time to watch; 0: until the recording ends")


class WatchJob:
    """A `Job` that commands neither gripper nor arm."""

    stages = ("reference", "watch")

    def __init__(self, options: WatchOptions | None = None, context: BuildContext | None = None) -> None:
        self._duration_ns = nanoseconds((options or WatchOptions()).duration_s)

    def begin(self, setting: Setting) -> None:
        """Start watching."""
        self._end_ns = setting.t_ns + self._duration_ns

    def step(self, now: Situation) -> Wanted:
        """Continue until the time is over."""
        over = self._duration_ns > 0 and now.t_ns >= self._end_ns
        return Wanted("watch" if now.referenced else "reference", done=over)
