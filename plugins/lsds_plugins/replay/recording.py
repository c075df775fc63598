"""Sensor `recording`: one finger of a recorded run, played as if it were a camera."""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING

from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import Frame
from lsds.errors import DataError
from lsds_plugins.replay.played import PlayedSensor

if TYPE_CHECKING:
    from lsds.contracts import BuildContext, SensorSpec
    from lsds.session.recording.reader import Recording


class RecordingOptions(BaseModel):
    """Options of `[sensor.recording]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    path: str = Field(default="", description="recording of a run (lsds run --record F.mcap)")
    finger: str = Field(default="", description="name of the recorded finger; empty: the first")


class RecordingSensor(PlayedSensor):
    """A `TactileSensor` that shows the frames of one recorded finger at the intervals of their exposures."""

    def __init__(self, options: RecordingOptions, context: BuildContext) -> None:
        super().__init__("recording", options.path, context.clock)
        self._options = options
        self._opened: Recording | None = None

    @property
    def spec(self) -> SensorSpec:
        """The spec of the recorded sensor. Raises DataError."""
        recording = self._recording()
        name = self._options.finger or recording.header.fingers[0].name
        for finger in recording.header.fingers:
            if finger.name == name:
                return finger.spec
        known = ", ".join(finger.name for finger in recording.header.fingers)
        raise DataError(f"{self._options.path}: no finger '{name}' (there are {known})")

    def frames(self, start_ns: int = 0) -> Generator[Frame, None, None]:
        """Yield every frame; the first is stamped `start_ns`. Raises DataError naming file and frame."""
        first_ns: int | None = None
        for _, frame in self._recording().frames(self._options.finger or None):
            first_ns = frame.t_ns if first_ns is None else first_ns
            yield Frame(frame.image, start_ns + frame.t_ns - first_ns, frame.seq, frame.redrawn)
        if self._recording().damage:
            raise DataError(f"{self._options.path}: {self._recording().damage} (the earlier frames are valid)")

    def _recording(self) -> Recording:
        if not self._options.path:
            raise DataError("recording: no recording named (set sensor.recording.path)")
        if self._opened is None:
            from lsds.session.recording.reader import Recording

            self._opened = Recording(self._options.path)
        return self._opened
