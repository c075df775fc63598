"""Run the algorithms again on a recorded run, and compare what they answer with what was recorded."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lsds.clock import VirtualClock
from lsds.config.loader import check_config
from lsds.config.overrides import apply_overrides
from lsds.contracts import Cycle
from lsds.errors import DataError, LsdsError
from lsds.registry.backends import NO_DEVICE
from lsds.registry.host import PluginHost
from lsds.runtime.replay_engine import ReplayEngine
from lsds.runtime.rig import Rig
from lsds.session.parts import is_given, with_parts
from lsds.session.recording.codec import to_text
from lsds.session.recording.messages import CORRECTION, Message, messages_of
from lsds.session.recording.reader import Recording
from lsds.support.blas import one_blas_thread

if TYPE_CHECKING:
    from lsds.config import RigConfig
    from lsds.contracts.events import Event, Published
    from lsds.session.recording.header import RecordingHeader
    from lsds.session.recording.reader import Raw


@dataclass(slots=True)
class Stream:
    """The comparison of one topic: messages in both, those that differ, and messages that only one has.

    `largest` is the largest difference of a number, with the field that it is in, at `first_s` for the first time
    (seconds since the recording's start).
    """

    topic: str
    compared: int = 0
    different: int = 0
    only_recorded: int = 0
    only_replayed: int = 0
    largest: float = 0.0
    where: str = ""
    first_s: float = math.nan

    @property
    def identical(self) -> bool:
        """Whether both are the same bit by bit."""
        return not (self.different or self.only_recorded or self.only_replayed)


@dataclass(slots=True)
class ReplayResult:
    """The result of a replay.

    `complete`: it came to the recording's end. `problem` is the error that ended it, which may be that of the
    recorded run; `damage` says that the recording is cut off. `recorded` and `replayed` hold numbers for a picture.
    """

    source: str
    header: RecordingHeader
    changed: tuple[str, ...]
    streams: dict[str, Stream] = field(default_factory=dict)
    cycles: int = 0
    complete: bool = False
    problem: str = ""
    damage: str = ""
    recorded: list[dict[str, Any]] = field(default_factory=list)
    replayed: list[dict[str, Any]] = field(default_factory=list)

    @property
    def identical(self) -> bool:
        """Whether the whole recording was replayed, and every output is the same bit by bit."""
        return self.complete and bool(self.streams) and all(stream.identical for stream in self.streams.values())

    def as_dict(self) -> dict[str, Any]:
        """Return the figures of the comparison."""
        return {
            "source": self.source,
            "recorded_with": self.header.lsds,
            "changed": list(self.changed),
            "cycles": self.cycles,
            "complete": self.complete,
            "identical": self.identical,
            "problem": self.problem,
            "damage": self.damage,
            "streams": {
                name: {key: getattr(stream, key) for key in Stream.__slots__ if key != "topic"}
                for name, stream in sorted(self.streams.items())
            },
        }


@one_blas_thread()
def replay(
    source: str | Path,
    overrides: str | Sequence[str] = (),
    *,
    observe: Callable[[Cycle], object] | None = None,
    tracker: Any = None,
    detector: Any = None,
    estimator: Any = None,
    controller: Any = None,
) -> ReplayResult:
    """Replay a recording with its own configuration, changed by `overrides` ("detector.backend=imprint").

    The job's wishes and the devices' states are those of the recording, so what a controller would have commanded has
    no effect: it is an open loop. `observe` is called with every cycle; `tracker`, `detector`, `estimator` and
    `controller` replace those of the recording, as for `run`. Raises DataError for a file that is no recording,
    ConfigError and PluginError for an override that cannot be used.
    """
    recording = Recording(source)
    changed = (overrides,) if isinstance(overrides, str) else tuple(overrides)
    result = ReplayResult(str(source), recording.header, changed)
    parts = {"tracker": tracker, "detector": detector, "estimator": estimator, "controller": controller}
    rig = _rig(recording, changed, parts)
    comparison = _Comparison(result)
    inputs = comparison.inputs(recording)
    engine = ReplayEngine(rig, inputs, live=recording.header.live)
    engine.events.add("comparison", comparison.replayed)
    try:
        if observe is None:
            engine.run()
        else:
            for cycle in engine:
                observe(cycle)
        # The job's end is followed by outputs and truths.
        for _ in inputs:
            pass
    except LsdsError as error:
        result.problem = str(error)
    finally:
        rig.close()
    (statistics,) = engine.events.statistics()
    if statistics.failure:
        result.problem, result.complete = result.problem or statistics.failure, False
    comparison.finish()
    result.damage = recording.damage
    if not result.cycles:
        result.complete = False
        result.problem = result.problem or "the recording has no frame with an answer, so there is nothing to compare"
    return result


def replayed_config(
    header: RecordingHeader, path: Path, overrides: Sequence[str], host: PluginHost, given: Collection[str] = ()
) -> RigConfig:
    """Return the configuration of a recording with its fingers as sensors and without devices.

    `given` are the kinds that are replaced by objects. Raises ConfigError, and DataError for a recording whose
    algorithm was an object of the program that made it.
    """
    tables: dict[str, Any] = tomllib.loads(header.config)
    for kind in (kind for kind, table in tables.items() if is_given(table)):
        if kind not in given and not any(text.startswith(f"{kind}.backend=") for text in overrides):
            raise DataError(
                f"{path}: its {kind} was an object of the program that recorded it (pass {kind}= to lsds.replay, or "
                f"--set {kind}.backend=NAME)"
            )
        del tables[kind]["backend"]
    for name in ("sensor", "faults"):
        tables.pop(name, None)
    tables["sensors"] = {
        finger.name: {
            "backend": host.own("sensor", "recording"),
            "opposite": finger.opposite,
            "recording": {"path": str(path), "finger": finger.name},
        }
        for finger in header.fingers
    }
    tables |= {kind: {"backend": NO_DEVICE} for kind in ("gripper", "arm", "pose_source", "cell")}
    tables |= {"job": {"backend": host.own("job", "watch")}, "clock": "auto"}
    issues = apply_overrides(tables, tuple(overrides))
    return check_config(tables, f"{path} with --set" if overrides else str(path), host, issues)


@dataclass(frozen=True, slots=True)
class _RecordedDevice:
    """A gripper or an arm of which only the spec is asked for."""

    spec: Any


def _rig(recording: Recording, overrides: Sequence[str], parts: Mapping[str, Any]) -> Rig:
    header, host = recording.header, PluginHost()
    given = [kind for kind, part in parts.items() if part is not None]
    with with_parts(replayed_config(header, recording.path, overrides, host, given), parts) as config:
        rig = Rig(config, host, clock=VirtualClock(header.started_ns))
    devices: Any = rig
    devices.gripper = None if header.gripper is None else _RecordedDevice(header.gripper)
    devices.arm = None if header.arm is None else _RecordedDevice(header.arm)
    return rig


class _Comparison:
    """Pairs recorded and replayed messages by topic and time; keeps only those without a partner."""

    def __init__(self, result: ReplayResult) -> None:
        self._result = result
        self._waiting: dict[tuple[str, int], tuple[bool, bytes]] = {}
        self._last_ns = 0

    def inputs(self, recording: Recording) -> Iterator[Event]:
        """Yield the recording's inputs; take note of its outputs on the way."""
        for event, output in recording.steps():
            if output is not None:
                self._recorded(output)
            elif event is not None:
                for message in _compared(event):
                    text = to_text(message.value)
                    self._take(message.topic, text, message.now_ns, recorded=True)
                    self._keep(self._result.recorded, message.topic, text, message.now_ns)
                yield event
        self._result.complete = True

    def replayed(self, event: Published) -> None:
        """Take what the replay puts out."""
        if isinstance(event, Cycle):
            self._result.cycles += 1
            messages = [message for message in messages_of(event) if isinstance(message, Message)]
        else:
            messages = _compared(event)
        for message in messages:
            text = to_text(message.value)
            self._take(message.topic, text, message.now_ns, recorded=False)
            self._keep(self._result.replayed, message.topic, text, message.now_ns)

    def finish(self) -> None:
        """Count what has no partner."""
        for (topic, now_ns), (recorded, _) in self._waiting.items():
            if not recorded and now_ns >= self._last_ns:
                continue  # A recording that was cut off or repaired may end in the middle of a cycle.
            stream = self._stream(topic)
            if recorded:
                stream.only_recorded += 1
            else:
                stream.only_replayed += 1
            stream.first_s = _earlier(stream.first_s, self._seconds(now_ns))
        self._waiting.clear()

    def _recorded(self, output: Raw) -> None:
        self._last_ns = max(self._last_ns, output.now_ns)
        self._take(output.topic, output.data, output.now_ns, recorded=True)
        self._keep(self._result.recorded, output.topic, output.data, output.now_ns)

    def _take(self, topic: str, text: bytes, now_ns: int, *, recorded: bool) -> None:
        key = topic, now_ns
        before = self._waiting.pop(key, None)
        if before is None:
            self._waiting[key] = (recorded, text)
            return
        stream = self._stream(topic)
        stream.compared += 1
        if before[1] == text:
            return
        one, other = (json.loads(each) for each in ((before[1], text) if before[0] else (text, before[1])))
        if one == other:
            return  # An older version wrote the same numbers otherwise.
        stream.different += 1
        stream.first_s = _earlier(stream.first_s, self._seconds(now_ns))
        where, largest = _largest(one, other)
        if not stream.where or largest > stream.largest:
            stream.where, stream.largest = where, largest

    def _stream(self, topic: str) -> Stream:
        return self._result.streams.setdefault(topic, Stream(topic))

    def _seconds(self, now_ns: int) -> float:
        return (now_ns - self._result.header.started_ns) * 1e-9

    def _keep(self, series: list[dict[str, Any]], topic: str, text: bytes, now_ns: int) -> None:
        """Keep the numbers of a picture."""
        if topic in _DRAWN:
            value = json.loads(text)
            series.append({"topic": topic, "s": self._seconds(now_ns)} | {key: value[key] for key in _DRAWN[topic]})


_DRAWN = {
    "/grip": ("slips", "load_n", "limit_n"),
    "/detection": ("score", "threshold", "slip"),
    "/estimate": ("speed_m_s",),
    CORRECTION: ("wanted_m", "sent_m"),
    "/cycle": ("held_m", "stage"),
}
"""Fields that a picture shows, by topic."""


def _compared(event: Event) -> list[Message]:
    """Return the messages of an event that are an answer of the algorithms: a correction."""
    return [message for message in messages_of(event) if isinstance(message, Message) and message.topic == CORRECTION]


def _earlier(one: float, other: float) -> float:
    return other if math.isnan(one) else min(one, other)


def _largest(one: Any, other: Any, path: str = "") -> tuple[str, float]:
    """Return the place and the size of the largest difference of two JSON values; infinite where they have other
    forms, or where one is unknown."""
    if isinstance(one, dict) and isinstance(other, dict):
        found = [
            _largest(one.get(key), other.get(key), f"{path}.{key}" if path else key)
            for key in {*one, *other}
            if one.get(key) != other.get(key)
        ]
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        found = [_largest(a, b, f"{path}[{at}]") for at, (a, b) in enumerate(zip(one, other, strict=True)) if a != b]
    elif isinstance(one, int | float) and isinstance(other, int | float):
        return path, abs(float(one) - float(other))
    else:
        return path, math.inf
    return max(found, key=lambda each: each[1], default=(path, 0.0))
