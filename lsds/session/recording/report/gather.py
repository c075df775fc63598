"""Read a recording once, and keep what its report shows."""

from __future__ import annotations

import math
import tomllib
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from lsds.clock import seconds
from lsds.errors import DataError
from lsds.registry.backends import NO_DEVICE
from lsds.session.recording.messages import (
    CORRECTION,
    CYCLE,
    FUSED_DETECTION,
    FUSED_ESTIMATE,
    GRIP,
    GRIPPER,
    IMAGE,
    JOB,
    TRUTH,
)
from lsds.session.recording.reader import Raw, Recording
from lsds.session.recording.report.curves import Curve
from lsds.session.recording.report.images import ThinnedImages

if TYPE_CHECKING:
    from lsds.session.recording.header import RecordingHeader

MM = 1e3
"""Millimetres per metre: the unit of apertures in the page."""
CM = 1e2
"""Centimetres per metre: the unit of slip in the page."""


class Stage(NamedTuple):
    """A stage of the job, seconds since the recording began."""

    name: str
    begin_s: float
    end_s: float


class Happening(NamedTuple):
    """One line of the list of events."""

    t_s: float
    kind: str
    text: str


@dataclass(slots=True)
class RunData:
    """The content of a report. Curves carry the time at which their values were true, s since the beginning.

    `summary` is that of the run, None if the recording has none; `damage` states where a damaged file ends.
    """

    path: Path
    header: RecordingHeader
    summary: dict[str, Any] | None = None
    damage: str = ""
    curves: dict[str, Curve] = field(default_factory=lambda: defaultdict(Curve))
    stages: list[Stage] = field(default_factory=list)
    happenings: list[Happening] = field(default_factory=list)
    images: dict[str, ThinnedImages] = field(default_factory=dict)
    cycles: int = 0
    begin_s: float = math.inf
    end_s: float = -math.inf

    @property
    def cell(self) -> str:
        """The simulated cell of the configuration, "" for none or if the configuration cannot be read."""
        try:
            name = str(tomllib.loads(self.header.config).get("cell", {}).get("backend", NO_DEVICE))
        except (tomllib.TOMLDecodeError, AttributeError):
            return ""
        return "" if name == NO_DEVICE else name

    @property
    def simulated(self) -> bool:
        """Whether figures are simulated, be it those of some devices only."""
        return self.header.simulated or bool(self.cell) or (self.summary or {}).get("figures_are") == "simulated"


def gather(path: str | Path) -> RunData:
    """Return what the report of a recording shows. Raises DataError for a file that is no recording of lsds."""
    recording = Recording(path)
    data = RunData(recording.path, recording.header)
    data.images = {finger.name: ThinnedImages() for finger in recording.header.fingers}
    reading = _Reading(data)
    for number, message in enumerate(recording.messages()):
        try:
            reading.take(message)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise DataError(
                f"{path}: message {number} of {message.topic}: not what its topic promises: {error!r} (was the file "
                "edited?)"
            ) from error
    data.summary, data.damage = recording.summary, recording.damage
    reading.finish()
    if not data.end_s >= data.begin_s:
        raise DataError(f"{path}: the recording holds no message, so there is nothing to report")
    return data


class _Reading:
    """Takes the messages of a recording in their order."""

    def __init__(self, data: RunData) -> None:
        self._data = data
        self._stage = ("", 0.0)
        self._slips = False
        self._fingers = {IMAGE.format(name): images for name, images in data.images.items()}
        self._takers: dict[str, Callable[[Any, float, float], None]] = {
            FUSED_DETECTION: self._detection,
            FUSED_ESTIMATE: self._estimate,
            GRIP: self._grip,
            GRIPPER: self._gripper,
            CYCLE: self._cycle,
            JOB: self._job,
            CORRECTION: self._correction,
            TRUTH: self._truth,
        }

    def take(self, message: Raw) -> None:
        now_s, t_s = self._seconds(message.now_ns), self._seconds(message.t_ns)
        self._data.begin_s, self._data.end_s = min(self._data.begin_s, now_s), max(self._data.end_s, now_s)
        if message.topic in self._fingers:
            self._fingers[message.topic].add(t_s, _stored(message.data))
        elif message.topic in self._takers:
            self._takers[message.topic](message.value, now_s, t_s)

    def finish(self) -> None:
        data = self._data
        self._end_stage(data.end_s)
        summary = data.summary or {}
        for fault in summary.get("faults", ()):
            if fault["began_s"] is not None:
                began_s = fault["began_s"] - seconds(data.header.started_ns)
                data.happenings.append(Happening(began_s, "fault", f"{fault['backend']} began on purpose"))
        if summary.get("fault"):
            data.happenings.append(Happening(data.end_s, "fault", summary["fault"]))
        if data.damage:
            data.happenings.append(Happening(data.end_s, "file", "the recording ends here, damaged or cut off"))
        data.happenings.sort(key=lambda each: each.t_s)

    def _seconds(self, t_ns: int) -> float:
        return round(seconds(t_ns - self._data.header.started_ns), 6)

    def _detection(self, value: Any, now_s: float, t_s: float) -> None:
        self._data.curves["detected"].add(t_s, value.get("probability"))
        if value["slip"] and not self._slips:
            self._happened(now_s, "slip", f"detected, statistic {value['score']:.3g} over {value['threshold']:.3g}")
        self._slips = bool(value["slip"])

    def _estimate(self, value: Any, now_s: float, t_s: float) -> None:
        self._data.curves["speed"].add(t_s, value["speed_m_s"], CM, value["speed_std_m_s"])

    def _grip(self, value: Any, now_s: float, t_s: float) -> None:
        self._data.curves["slips"].add(t_s, value["slips"])
        self._data.curves["load"].add(t_s, value["load_n"])
        self._data.curves["limit"].add(t_s, value["limit_n"], std=value["limit_std_n"])

    def _gripper(self, value: Any, now_s: float, t_s: float) -> None:
        self._data.curves["measured"].add(t_s, value["aperture_m"], MM)

    def _cycle(self, value: Any, now_s: float, t_s: float) -> None:
        self._data.cycles += 1
        self._data.curves["commanded"].add(now_s, value["held_m"], MM)

    def _job(self, value: Any, now_s: float, t_s: float) -> None:
        stage = value["wanted"]["stage"]
        if stage != self._stage[0]:
            self._end_stage(now_s)
            self._stage = (stage, now_s)
            self._happened(now_s, "stage", stage)

    def _correction(self, value: Any, now_s: float, t_s: float) -> None:
        wanted, sent = value["wanted_m"], value["sent_m"]
        self._data.curves["wanted"].add(now_s, wanted, MM)
        became = "not sent" if sent is None else f"sent {MM * sent:.3f} mm"
        self._happened(now_s, "correction", f"wanted {MM * wanted:.3f} mm, {became}")

    def _truth(self, value: Any, now_s: float, t_s: float) -> None:
        self._data.curves["true_speed"].add(t_s, math.hypot(*value["slip_velocity_m_s"]), CM)

    def _end_stage(self, now_s: float) -> None:
        name, begin_s = self._stage
        if name and now_s > begin_s:
            self._data.stages.append(Stage(name, begin_s, now_s))

    def _happened(self, t_s: float, kind: str, text: str) -> None:
        self._data.happenings.append(Happening(t_s, kind, text))


def _stored(data: bytes) -> bytes:
    """Return the compressed image in a message; empty if the message is damaged."""
    from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
    from google.protobuf.message import DecodeError  # type: ignore[import-untyped]

    try:
        return bytes(CompressedImage.FromString(data).data)
    except DecodeError:
        return b""
