"""Faults on the wire as seeded data: kind, face, probability and time."""

from __future__ import annotations

import random
import re
import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, Self, get_args

from pydantic import BaseModel, ConfigDict, Field, model_validator

from lsds.clock import NS_PER_S, nanoseconds
from lsds.errors import ConfigError, ConfigIssue
from lsds.registry.backends import did_you_mean
from lsds.registry.options import validated

if TYPE_CHECKING:
    from lsds.clock import Clock

FaultKind = Literal[
    "drop",
    "delay",
    "corrupt",
    "crc",
    "truncate",
    "split",
    "duplicate",
    "freeze",
    "disconnect",
    "wrong-slave",
    "busy",
    "in-use",
    "delayed-ack",
    "protective-stop",
    "emergency-stop",
    "gripper-fault",
    "black-frame",
    "torn-frame",
]
MESSAGE_FAULTS: tuple[FaultKind, ...] = ("drop", "delay", "corrupt", "truncate", "split", "duplicate")
"""Faults of a single outgoing message, applied by `FaultInjector.outgoing` on every face."""


PROBABILITIES = (0.05, 0.1, 0.25, 0.5, 1.0)
"""Probability per message or frame at the severities 1 to 5."""
DELAYS_MS = (10.0, 25.0, 50.0, 100.0, 250.0)
"""Delay at the severities 1 to 5 (ms)."""
_BY_PROBABILITY = frozenset(
    {"drop", "corrupt", "crc", "truncate", "duplicate", "wrong-slave", "black-frame", "torn-frame"}
)
_BY_DELAY = frozenset({"delay", "split"})
_NEVER_NS = 2**63
"""Start of a fault that still awaits its frame, ns: later than any clock value."""


class Fault(BaseModel):
    """One fault. By default it applies to every message from the start; the other fields limit it."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    kind: FaultKind
    face: str = Field(default="", description="name of the face it applies to; empty: all")
    probability: float = Field(default=1.0, ge=0, le=1, description="probability for each message, frame or cycle")
    after_s: float = Field(
        default=0.0, ge=0, description="delay of its start after the mock's start, or after its injection"
    )
    for_s: float | None = Field(default=None, gt=0, description="duration; default: unlimited")
    count: int | None = Field(default=None, ge=1, description="maximum number of times it occurs")
    delay_ms: float = Field(default=50.0, ge=0, le=60_000, description="delay of `delay`, `split` and `delayed-ack`")
    code: int = Field(default=0, ge=0, le=255, description="value of the fault register for `gripper-fault`")
    severity: int | None = Field(
        default=None, ge=1, le=5, description="1 (hardly noticed) to 5 (the worst), in place of probability or delay"
    )
    when: str = Field(
        default="", description="words that a received frame has to contain for the fault to start: `write 1000`"
    )
    nth: int = Field(default=1, ge=1, description="number of such frames up to and including the one that starts it")
    name: str = Field(default="", description="name by which the fault can be ended")

    @model_validator(mode="after")
    def _one_strength(self) -> Self:
        if self.severity is None:
            return self
        if self.kind not in _BY_PROBABILITY | _BY_DELAY:
            raise ValueError(f"'{self.kind}' has no severity: it is on or off; leave out severity")
        if self.model_fields_set & ({"delay_ms"} if self.kind in _BY_DELAY else {"probability"}):
            raise ValueError("severity replaces probability and delay_ms; give one of them")
        return self

    @property
    def chance(self) -> float:
        """Probability per message, frame or cycle."""
        by_severity = self.severity is not None and self.kind in _BY_PROBABILITY
        return PROBABILITIES[self.severity - 1] if by_severity and self.severity else self.probability

    @property
    def wait_s(self) -> float:
        """Delay of the message (s)."""
        by_severity = self.severity is not None and self.kind in _BY_DELAY
        return (DELAYS_MS[self.severity - 1] if by_severity and self.severity else self.delay_ms) / 1e3


@dataclass(slots=True)
class _Armed:
    """A fault with its own random stream and its count."""

    fault: Fault
    begins_ns: int
    ends_ns: int | None
    rng: random.Random
    struck: int = field(default=0)
    awaited: int = field(default=0)
    """Number of frames that still have to arrive before it starts; 0 if it has started."""

    def start(self, now_ns: int) -> None:
        self.begins_ns = now_ns + nanoseconds(self.fault.after_s)
        self.ends_ns = None if self.fault.for_s is None else self.begins_ns + nanoseconds(self.fault.for_s)

    def strikes(self, now_ns: int) -> bool:
        fault = self.fault
        if now_ns < self.begins_ns or (self.ends_ns is not None and now_ns >= self.ends_ns):
            return False
        if fault.count is not None and self.struck >= fault.count:
            return False
        if fault.chance < 1 and self.rng.random() >= fault.chance:
            return False
        self.struck += 1
        return True


class FaultInjector:
    """All faults of one mock.

    `knows` maps each supported kind to the faces on which it can occur, or to no faces if it concerns the whole mock;
    other kinds are refused. Equal seed and messages give equal faults: each fault draws from a separate random stream,
    once per message.
    """

    def __init__(
        self,
        mock: str,
        faults: Iterable[Fault],
        knows: Mapping[FaultKind, Sequence[str]],
        *,
        seed: int,
        clock: Clock,
    ) -> None:
        self._mock = mock
        self._knows = knows
        self._seed = seed
        self._clock = clock
        self._lock = threading.Lock()
        self._armed: tuple[_Armed, ...] = ()
        self._added = 0
        self._awaits = False
        for fault in faults:
            self.add(fault)

    def add(self, fault: Fault | Mapping[str, Any]) -> None:
        """Arm a fault; its `after_s` counts from now. Raises ConfigError for one that cannot occur on this mock."""
        if not isinstance(fault, Fault):
            self._require_known(str(fault.get("kind", "")))
            fault = validated(Fault, fault, "fault")
        self._require_known(fault.kind)
        faces = self._knows[fault.kind]
        if fault.face and fault.face not in faces:
            problem = f"'{fault.kind}' does not occur on a face '{fault.face}'"
            remedy = f"it concerns the whole {self._mock}; leave out the face"
            if faces:
                remedy = did_you_mean(fault.face, faces) or f"its faces: {', '.join(faces)}"
            raise ConfigError(self._mock, [ConfigIssue("fault.face", problem, remedy)])
        with self._lock:
            rng = random.Random(f"{self._seed}/{self._added}/{fault.kind}/{fault.face}")
            self._added += 1
            armed = _Armed(fault, _NEVER_NS, None, rng)
            if fault.when:
                armed.awaited = fault.nth
            else:
                armed.start(self._clock.now())
            self._armed = (*self._armed, armed)
            self._awaits = any(armed.awaited for armed in self._armed)

    def end(self, name: str) -> None:
        """End all faults of a name. Raises ConfigError for an unknown name."""
        with self._lock:
            kept = tuple(armed for armed in self._armed if armed.fault.name != name)
            if not name or len(kept) == len(self._armed):
                names = sorted({armed.fault.name for armed in self._armed} - {""})
                remedy = f"names in use: {', '.join(names)}" if names else "give the fault a name when it begins"
                raise ConfigError(self._mock, [ConfigIssue("name", f"no fault has the name '{name}'", remedy)])
            self._armed = kept
            self._awaits = any(armed.awaited for armed in kept)

    @property
    def awaits(self) -> bool:
        """Whether a fault waits for a frame from the client."""
        return self._awaits

    def heard(self, face: str, meaning: str) -> bool:
        """Count a received frame; return whether it starts a fault, which then also applies to the frame itself."""
        words, started = _words(meaning), False
        with self._lock:
            for armed in self._armed:
                fault = armed.fault
                if armed.awaited and fault.face in ("", face) and _words(fault.when) <= words:
                    armed.awaited -= 1
                    if not armed.awaited:
                        armed.start(self._clock.now())
                        started = True
            self._awaits = any(armed.awaited for armed in self._armed)
        return started

    @property
    def quiet(self) -> bool:
        """Whether no fault is armed; lets every per-message path return early."""
        return not self._armed

    def strikes(self, kind: FaultKind, face: str) -> Fault | None:
        """Return the fault of this kind that occurs on this face now, drawn at random; else None."""
        if not self._armed:
            return None
        now = self._clock.now()
        with self._lock:
            for armed in self._armed:
                fault = armed.fault
                if fault.kind == kind and fault.face in ("", face) and armed.strikes(now):
                    return fault
        return None

    def outgoing(self, message: bytes, face: str) -> list[tuple[float, bytes]]:
        """Return the parts that replace one message, in order: (delay in seconds, bytes); empty if it is lost."""
        if not self._armed:
            return [(0.0, message)]
        if self.strikes("drop", face):
            return []
        if self.strikes("corrupt", face) and message:
            rng = self._stream("corrupt")
            spoilt = bytearray(message)
            spoilt[rng.randrange(len(spoilt))] ^= 1 << rng.randrange(8)
            message = bytes(spoilt)
        if self.strikes("truncate", face):
            message = message[: max(1, len(message) // 2)]
        late = self.strikes("delay", face)
        delay = late.wait_s if late else 0.0
        parts = [(delay, message)]
        split = self.strikes("split", face)
        if split and len(message) > 1:
            half = len(message) // 2
            parts = [(delay, message[:half]), (delay + split.wait_s, message[half:])]
        if self.strikes("duplicate", face):
            parts.append((parts[-1][0], message))
        return parts

    def remaining_s(self, fault: Fault) -> float | None:
        """Duration of a fault that has occurred; None if it never ends."""
        for armed in self._armed:
            if armed.fault is fault and armed.ends_ns is not None:
                return max(0.0, (armed.ends_ns - self._clock.now()) / NS_PER_S)
        return None

    def _require_known(self, kind: str) -> None:
        if kind in self._knows:
            return
        known = f"one of: {', '.join(known for known in get_args(FaultKind) if known in self._knows)}"
        problem = f"'{kind}' is no fault of this mock" if kind else "is missing"
        remedy = " ".join(part for part in (did_you_mean(kind, self._knows), known) if part)
        raise ConfigError(self._mock, [ConfigIssue("fault.kind", problem, remedy)])

    def _stream(self, kind: FaultKind) -> random.Random:
        return next((armed.rng for armed in self._armed if armed.fault.kind == kind), random.Random(self._seed))


def _words(text: str) -> frozenset[str]:
    return frozenset(re.findall(r"[\w.+-]+", text.lower()))
