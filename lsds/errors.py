"""Every error that lsds raises on purpose, in one tree.

A message states what happened, where, and what to do next. Catch `LsdsError` to catch them all;
the docstring of each class states when it is raised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any


class LsdsError(Exception):
    """The base class of all errors that lsds raises on purpose."""

    exit_code = 1

    def __reduce__(self) -> tuple[Any, ...]:
        """Let an error go to another process, whatever its constructor takes."""
        return _rebuilt, (type(self), self.args, self.__dict__)


def _rebuilt(kind: type[LsdsError], args: tuple[Any, ...], state: dict[str, Any]) -> LsdsError:
    error = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(state)
    return error


# -- configuration ----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ConfigIssue:
    """One problem in a configuration: the dotted path, the problem, and the remedy and the file's line if known."""

    path: str
    problem: str
    remedy: str = ""
    line: int | None = None

    def __str__(self) -> str:
        place = self.path if self.line is None else f"{self.path} (line {self.line})"
        return f"{place}: {self.problem}" + (f" ({self.remedy})" if self.remedy else "")


class ConfigError(LsdsError):
    """The configuration is invalid; `issues` holds all problems found."""

    exit_code = 2

    def __init__(self, source: str, issues: Sequence[ConfigIssue]) -> None:
        self.source = source
        self.issues = tuple(issues)
        count = f"{len(self.issues)} problem" + ("s" if len(self.issues) != 1 else "")
        super().__init__(f"{source}: {count}\n" + "\n".join(f"  {issue}" for issue in self.issues))


# -- plugins ----------------------------------------------------------------------------------------------


class PluginError(LsdsError):
    """A plugin failed, or was requested in a wrong way."""

    exit_code = 3


class PluginNotFound(PluginError):
    """No installed plugin offers a backend of that kind and name."""


class PluginLoadError(PluginError):
    """The plugin is installed but importing it, or a library it requires, failed."""


class PluginConflict(PluginError):
    """Two distributions offer the same kind and name; the config must name `distribution:name`."""


def raised_by(backend: str, error: Exception, where: str = "") -> PluginError:
    """Return the error for an unexpected exception of a backend; raise it `from` that exception."""
    at = f" at {where}" if where else ""
    return PluginError(
        f"{backend} raised {type(error).__name__}{at}: {error} (a bug in that plugin; lsds --debug shows where)"
    )


class ContractMismatch(PluginError):
    """The object returned by a plugin's factory lacks members of its kind's contract."""


class MissingExtra(PluginLoadError):
    """A library that only some installations have is needed here; the message names the extra that brings it."""


# -- devices ----------------------------------------------------------------------------------------------


class DeviceError(LsdsError):
    """A device (sensor, gripper, arm, pose source, cell) failed.

    `device` names the backend, `remedy` what a person at the cell can do, and `code` carries the device's own
    fault code where it has one.
    """

    exit_code = 4

    def __init__(self, device: str, problem: str, *, remedy: str = "", code: int | str | None = None) -> None:
        self.device = device
        self.problem = problem
        self.remedy = remedy
        self.code = code
        label = f"{device}: {problem}" + (f" [code {code}]" if code is not None else "")
        super().__init__(label + (f" ({remedy})" if remedy else ""))


class ConnectFailed(DeviceError):
    """The device could not be opened: wrong port, no power, held by another process."""


class ProtocolFault(DeviceError):
    """The device sent bytes that its protocol does not allow."""


class DeviceTimeout(DeviceError):
    """The device did not answer within the time that its protocol allows."""


class CallHangs(DeviceTimeout):
    """A device, or an algorithm, has not returned from a call within its deadline; it is left behind in that call.

    `device` names it by kind and backend, `call` is the call's name.
    """

    def __init__(self, device: str, call: str, limit_s: float, *, key: str = "") -> None:
        self.call = call
        longer = f"; raise {key} if it needs longer" if key else ""
        remedy = f"find what it waits for{longer}"
        super().__init__(device, f"has not returned from {call}() for {limit_s:g} s", remedy=remedy)
        self.args = (f"{device} {self.problem} ({remedy})",)


class StaleData(DeviceError):
    """No sample has arrived yet, or the newest sample is too old."""


class DeviceFault(DeviceError):
    """The device itself reports a fault: over-current, protective stop, activation fault."""


class ConnectionLost(DeviceFault):
    """The connection was lost after it had been opened; what the device does is unknown until it is back."""


class LifecycleError(DeviceError):
    """A call in a state that does not allow it, for example `command` before `arm`."""


class LimitExceeded(DeviceError):
    """A command exceeds the limits of the device or of the cell."""


class CommandExpired(DeviceError):
    """A motion command reached the device after its expiry and was not executed."""


class BringUpError(LsdsError):
    """One or more devices failed to connect or arm; the message lists the result of each device of the rig."""

    exit_code = 4


UNREACHABLE = (ConnectFailed, DeviceTimeout, ConnectionLost)
"""Errors after which it is not known what the device does."""


# -- data, models, safety ---------------------------------------------------------------------------------


class DataError(LsdsError):
    """A frame, recording or dataset cannot be used; the message names the file and the frame."""

    exit_code = 5


class CutOff(DataError):
    """A recording ends too early: its writing or copying was interrupted. The frames before are valid."""


class ModelError(LsdsError):
    """A trained model cannot be loaded or does not fit the features it is given."""

    exit_code = 6


class SafetyStop(LsdsError):
    """The cell was stopped on purpose: watchdog, limit, stale data or a person's request."""

    exit_code = 7


def naming(source: object, error: BaseException) -> str:
    """Return the error's text, with the source in front where it does not name it."""
    text = str(error)
    return text if str(source) in text else f"{source}: {text}"
