"""Messages of the controller to all clients of its primary interface."""

from __future__ import annotations

from dataclasses import dataclass

WARNING = 2
"""Report level of an `ErrorCode`: warning."""
VIOLATION = 3
"""Report level of an `ErrorCode`: violation."""
FAULT = 4
"""Report level of an `ErrorCode`: fault."""


@dataclass(frozen=True, slots=True)
class TextMessage:
    """A program's `textmsg`."""

    text: str


@dataclass(frozen=True, slots=True)
class PopupMessage:
    """A program's `popup`. A blocking one pauses the program until it is closed."""

    title: str
    text: str
    warning: bool = False
    error: bool = False
    blocking: bool = False


@dataclass(frozen=True, slots=True)
class KeyMessage:
    """A program started or stopped."""

    title: str
    text: str


@dataclass(frozen=True, slots=True)
class ErrorCode:
    """The controller's own error `C<code>A<argument>`."""

    code: int
    argument: int
    level: int
    text: str = ""


@dataclass(frozen=True, slots=True)
class RuntimeExceptionMessage:
    """A program failed, at a line and a column."""

    line: int
    column: int
    text: str


@dataclass(frozen=True, slots=True)
class SafetyModeMessage:
    """The safety mode has changed."""

    mode: int
    code: int = 0
    argument: int = 0


Message = TextMessage | PopupMessage | KeyMessage | ErrorCode | RuntimeExceptionMessage | SafetyModeMessage
