"""The cases of a client's trial: each fault of its mock at each severity, found by asking the mock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from lsds.errors import DeviceError
from lsds.registry.backends import did_you_mean
from lsds.testing.mock_handle import MockHandle

MOCKS = {"gripper": "hand-e", "arm": "ur5e", "sensor": "gelsight-mini"}
"""The mock of each kind, unless another one is named."""
KINDS = (
    *("drop", "delay", "corrupt", "crc", "truncate", "split", "duplicate", "freeze", "disconnect", "wrong-slave"),
    *("busy", "in-use", "delayed-ack", "protective-stop", "emergency-stop", "gripper-fault"),
    *("black-frame", "torn-frame"),
)
"""Kinds of faults that `all` means, as far as a mock takes them."""
SEVERITIES = (1, 2, 3, 4, 5)
"""Severities of the campaign: the scale of every fault."""
GRIPPER_CODE = 0x0B
"""Code of the fault that a gripper reports: an error in automatic release."""
_NEVER_S = 3600.0
"""Time after which an injected fault would begin by itself (s): later than the end of every trial."""


@dataclass(frozen=True, slots=True)
class Case:
    """One trial of a client: the kind of device and its mock, the client MODULE:CLASS, and a fault.

    An empty `fault` is a healthy line; `severity` is None for a fault that is on or off.
    """

    kind: str
    mock: str
    client: str
    fault: str = ""
    severity: int | None = None
    seed: int = 0
    settings: tuple[tuple[str, Any], ...] = ()

    @property
    def title(self) -> str:
        """The fault in words."""
        if not self.fault:
            return "none"
        return self.fault if self.severity is None else f"{self.fault} {self.severity}"

    def as_json(self) -> dict[str, Any]:
        """Return plain values."""
        return asdict(self) | {"settings": dict(self.settings)}


def case_of(values: dict[str, Any]) -> Case:
    """Return the case of `as_json`. Raises TypeError for other values."""
    return Case(**{**values, "settings": tuple(dict(values["settings"]).items())})


@dataclass(frozen=True, slots=True)
class Possible:
    """A fault that a mock takes: whether it has severities, and the face to name, "" if it concerns all of it."""

    kind: str
    scaled: bool
    face: str


def possible(mock: MockHandle, kinds: Sequence[str] = KINDS) -> list[Possible]:
    """Return those of the kinds that a running mock takes. The faults are armed for a later time and ended at once."""
    return [found for kind in kinds if (found := _possible(mock, kind)) is not None]


def _possible(mock: MockHandle, kind: str) -> Possible | None:
    for face in (mock.transport, ""):
        for scaled in (True, False):
            strength: dict[str, Any] = {"severity": SEVERITIES[-1]} if scaled else {}
            place = {"face": face} if face else {}
            try:
                mock.process.inject(kind, name="trial", after_s=_NEVER_S, **code_of(kind), **place, **strength)
            except DeviceError:
                continue
            mock.process.request({"request": "end", "name": "trial"})
            return Possible(kind, scaled, face)
    return None


def code_of(kind: str) -> dict[str, Any]:
    """Return the further values that a kind of fault needs."""
    return {"code": GRIPPER_CODE} if kind == "gripper-fault" else {}


def unknown(kinds: Sequence[str], found: Sequence[Possible]) -> str:
    """Return what is wrong with the names of faults that the mock does not take, "" if it takes all."""
    known = [fault.kind for fault in found]
    for kind in kinds:
        if kind not in known:
            return f"the mock has no fault '{kind}'; {did_you_mean(kind, known) or 'it has ' + ', '.join(known)}"
    return ""
