"""Every error that lsds raises on purpose, in one tree.

A message says what happened, where, and what to do next. Catch `LsdsError` to catch them all;
each class below names the scenario in which it is raised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


class LsdsError(Exception):
    """The root of the tree: an error that lsds raised on purpose and can explain."""

    exit_code = 1


# -- configuration ----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ConfigIssue:
    """One problem in a configuration: the dotted path, what is wrong there, and the remedy if one is known."""

    path: str
    problem: str
    remedy: str = ""

    def __str__(self) -> str:
        return f"{self.path}: {self.problem}" + (f" ({self.remedy})" if self.remedy else "")


class ConfigError(LsdsError):
    """The configuration is wrong; `issues` holds every problem found, not only the first."""

    exit_code = 2

    def __init__(self, source: str, issues: Sequence[ConfigIssue]) -> None:
        self.source = source
        self.issues = tuple(issues)
        count = f"{len(self.issues)} problem" + ("s" if len(self.issues) != 1 else "")
        super().__init__(f"{source}: {count}\n" + "\n".join(f"  {issue}" for issue in self.issues))


# -- plugins ----------------------------------------------------------------------------------------------


class PluginError(LsdsError):
    """Something is wrong with a plugin or with the way it was asked for."""

    exit_code = 3


class PluginNotFound(PluginError):
    """No installed plugin offers a backend of that kind and name."""


class PluginLoadError(PluginError):
    """The plugin is installed but importing it, or a library it requires, failed."""


class PluginConflict(PluginError):
    """Two distributions offer the same kind and name; the config has to say `distribution:name`."""


def raised_by(backend: str, error: Exception, where: str = "") -> PluginError:
    """Return the error for an exception that a backend should not have let out; raise it `from` that exception."""
    at = f" at {where}" if where else ""
    return PluginError(
        f"{backend} raised {type(error).__name__}{at}: {error} (a mistake in that plugin; lsds --debug shows where)"
    )


class ContractMismatch(PluginError):
    """What the plugin's factory returned lacks members that the contract of its kind asks for."""


class MissingExtra(PluginLoadError):
    """A library that only some installations have is needed here; the message names the extra that brings it."""


# -- devices ----------------------------------------------------------------------------------------------


class DeviceError(LsdsError):
    """A device (sensor, gripper, arm, pose source, cell) did not do what it was asked.

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
    """The device answered with bytes that its protocol does not allow."""


class DeviceTimeout(DeviceError):
    """The device did not answer in the time that its protocol allows."""


class StaleData(DeviceError):
    """No sample has arrived yet, or the newest one is older than allowed."""


class DeviceFault(DeviceError):
    """The device itself reports a fault: over-current, protective stop, activation fault."""


class LifecycleError(DeviceError):
    """A call came in a state that does not allow it, for example `command` before `arm`."""


class LimitExceeded(DeviceError):
    """A command asks for more than the device or the cell's safety limits allow."""


class CommandExpired(DeviceError):
    """A motion command reached the device after its expiry and was not carried out."""


class BringUpError(LsdsError):
    """One or more devices failed to come up; the message shows the whole rig as a tree of results."""

    exit_code = 4


# -- data, models, safety ---------------------------------------------------------------------------------


class DataError(LsdsError):
    """A frame, recording or dataset cannot be used; the message names the file and the frame."""

    exit_code = 5


class ModelError(LsdsError):
    """A trained model cannot be loaded or does not fit the features it is given."""

    exit_code = 6


class SafetyStop(LsdsError):
    """The cell was stopped on purpose: watchdog, limit, stale sensing or a person's request."""

    exit_code = 7
