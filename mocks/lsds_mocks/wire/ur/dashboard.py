"""The dashboard server: one line in, one line out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import PurePosixPath
from typing import TYPE_CHECKING

from lsds_mocks.wire.http_request import is_http_request
from lsds_mocks.wire.ur.controller import UNLOCK_EARLY
from lsds_mocks.wire.ur.messages import TextMessage
from lsds_mocks.wire.ur.net import Link, ProtocolEnd

if TYPE_CHECKING:
    from lsds_mocks.wire.ur.pendant import Pendant

GREETING = b"Connected: Universal Robots Dashboard Server\n"
LOCAL = (
    "Command is not allowed due to safety reasons, please switch robot to Remote Control mode "
    "and reconnect to port 29999"
)
_REMOTE_ONLY = (
    *("load", "play", "pause", "stop", "power on", "power off", "brake release", "unlock protective stop"),
    *("restart safety", "close safety popup", "shutdown"),
)
"""Requests that need remote control; `load` includes `load installation`."""
LONGEST_COMMAND = 65536
"""Maximum number of bytes without an end of line; chosen."""


class DashboardSession:
    """One client."""

    at_once = 2048

    def __init__(self, pendant: Pendant, link: Link) -> None:
        self._pendant = pendant
        self._link = link
        # A client that was connected while the control changed has to reconnect.
        self._handovers = pendant.controller.handovers
        self._buffer = b""
        link.send(GREETING)

    def received(self, data: bytes) -> None:
        """Process request lines. Raises ProtocolEnd after `quit`, for an endless line, and for an HTTP request."""
        *lines, self._buffer = (self._buffer + data).split(b"\n")
        for line in lines:
            text = line.decode("utf-8", "replace").strip()
            self._link.note(line + b"\n", text)
            if is_http_request(text):
                raise ProtocolEnd
            remote = self._pendant.controller.obeys(self._handovers)
            self._link.send(answer(self._pendant, text, remote=remote).encode() + b"\n")
            if text == "quit":
                raise ProtocolEnd
        if len(self._buffer) > LONGEST_COMMAND:
            raise ProtocolEnd

    def closed(self) -> None:
        """The client is gone."""


def answer(pendant: Pendant, request: str, *, remote: bool = True) -> str:
    """Carry out one request and return its reply; in local control those that move or stop the arm are refused."""
    if not remote and any(request == words or request.startswith(words + " ") for words in _REMOTE_ONLY):
        return LOCAL
    plain = _PLAIN.get(request)
    if plain is not None:
        return plain(pendant)
    for words, reply in _WITH_TEXT.items():
        if request == words or request.startswith(words + " "):
            return reply(pendant, request[len(words) :].strip())
    return f'could not understand: "{request}"'


def _power_on(p: Pendant) -> str:
    p.controller.power_on()
    return "Powering on"


def _power_off(p: Pendant) -> str:
    p.power_off()
    return "Powering off"


def _brake_release(p: Pendant) -> str:
    p.controller.power_on(brakes=True)
    return "Brake releasing"


def _unlock(p: Pendant) -> str:
    return "Protective stop releasing" if p.controller.unlock() else UNLOCK_EARLY


def _restart_safety(p: Pendant) -> str:
    p.controller.restart_safety()
    return "Restarting safety"


def _play(p: Pendant) -> str:
    return "Starting program" if p.play() else "Failed to execute: play"


def _pause(p: Pendant) -> str:
    return "Pausing program" if p.controller.pause_program() else "Failed to execute: pause"


def _stop(p: Pendant) -> str:
    p.stop()
    return "Stopped"


def _running(p: Pendant) -> str:
    return f"Program running: {_word(p.controller.program is not None and not p.controller.program.paused)}"


def _program_state(p: Pendant) -> str:
    name = PurePosixPath(p.loaded).name if p.loaded else "<unnamed>"
    program = p.controller.program
    state = "STOPPED" if program is None else "PAUSED" if program.paused else "PLAYING"
    return f"{state} {name}"


def _is_saved(p: Pendant) -> str:
    return f"true {PurePosixPath(p.loaded).name}" if p.loaded else "false <unnamed>"


def _load(p: Pendant, name: str) -> str:
    path = p.load(name)
    return f"Loading program: {path}" if path else f"File not found: {name}"


def _load_installation(p: Pendant, name: str) -> str:
    return f"Loading installation: {name}" if p.has_installation(name) else f"File not found: {name}"


def _close_popup(p: Pendant) -> str:
    p.controller.close_popup()
    return "closing popup"


def _shutdown(p: Pendant) -> str:
    p.shut_down()
    return "Shutting down"


def _add_to_log(p: Pendant, text: str) -> str:
    if not text:
        return "No log message to add"
    p.controller.post_message(TextMessage(text))
    return "Added log message"


def _set_mode(p: Pendant, mode: str) -> str:
    mode = mode.upper()
    if mode not in ("MANUAL", "AUTOMATIC"):
        return f"Failed setting operational mode: {mode.lower()}"
    p.operational_mode = mode
    return f"Operational mode '{mode}' is set"


def _clear_mode(p: Pendant) -> str:
    p.operational_mode = "NONE"
    return f"No longer controlling the operational mode. Current operational mode: '{p.operational_mode}'."


def _version(p: Pendant) -> str:
    return p.controller.options.version


def _word(value: bool) -> str:
    return "true" if value else "false"


_PLAIN: dict[str, Callable[[Pendant], str]] = {
    "PolyscopeVersion": lambda p: f"URSoftware {_version(p)} (Apr 29 2024)",
    "polyscopeVersion": lambda p: f"URSoftware {_version(p)} (Apr 29 2024)",
    "version": _version,
    "get serial number": lambda p: p.controller.options.serial,
    "get robot model": lambda p: p.controller.options.model.rstrip("e").upper(),
    "is in remote control": lambda p: _word(p.controller.remote),
    "robotmode": lambda p: f"Robotmode: {p.controller.power.mode.name}",
    "safetymode": lambda p: f"Safetymode: {p.controller.safety.name}",
    "safetystatus": lambda p: f"Safetystatus: {p.controller.safety.name}",
    "running": _running,
    "programState": _program_state,
    "get loaded program": lambda p: f"Loaded program: {p.loaded}" if p.loaded else "No program loaded",
    "isProgramSaved": _is_saved,
    "play": _play,
    "pause": _pause,
    "stop": _stop,
    "power on": _power_on,
    "power off": _power_off,
    "brake release": _brake_release,
    "unlock protective stop": _unlock,
    "restart safety": _restart_safety,
    "close popup": _close_popup,
    "close safety popup": lambda _: "closing safety popup",
    "get operational mode": lambda p: p.operational_mode,
    "clear operational mode": _clear_mode,
    "saveLog": lambda _: "Log saved to disk",
    "quit": lambda _: "Disconnected",
    "shutdown": _shutdown,
}
_WITH_TEXT: dict[str, Callable[[Pendant, str], str]] = {
    "load installation": _load_installation,
    "load": _load,
    "popup": lambda _, text: "showing popup",
    "addToLog": _add_to_log,
    "set operational mode": _set_mode,
    "generate flight report": lambda _, kind: f"Flight Report generated with id: {kind or 'System'}-0001",
    "generate support file": lambda _, folder: f"Completed successfully: {folder}/support.zip",
}
