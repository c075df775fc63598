"""The Franka Hand as libfranka offers it: commands that block, a stop, and a state that arrives at its own rate.

Documented in libfranka's reference: the calls, their units, that all are safe from any thread, and that homing
estimates `max_width`. Franka's data sheet states a stroke of 80 mm and a continuous force of 70 N. libfranka's issues
state what the reference omits:

- `stop` does not end every command (28, 52, 105, 111), and `move` onto an object blocks for minutes (18).
- `stop` after a grasp takes the pressure off the object (18, 111). That is its main purpose.
- `grasp` applies at least 30 N (111), and may return false while the hand holds an object already (108).

Assumed: the force is that of one finger, `grasp` goes no further than its width, and resolution and speed range.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable
from typing import Any, Protocol

from lsds.contracts import GripperSpec
from lsds.errors import ConnectFailed

STROKE_M = 0.08
"""Greatest distance between the fingers (m, data sheet)."""
SPEC = GripperSpec(stroke_m=STROKE_M, resolution_m=1e-4, speed_m_s=(0.02, 0.1), force_n=(30.0, 70.0), latency_s=0.1)
"""Stroke and greatest force: data sheet. Smallest force: libfranka's issue 111. The others are assumed."""
LEAST_WIDTH_M = 0.01
"""A hand whose `max_width` is below this (m) has not been homed."""


class HandState(Protocol):
    """One state: widths in metres, and whether the hand holds an object."""

    @property
    def width(self) -> float:
        """Distance between the fingers."""
        ...

    @property
    def max_width(self) -> float:
        """Greatest width, as homing found it."""
        ...

    @property
    def is_grasped(self) -> bool:
        """Whether the last grasp succeeded and still holds."""
        ...


class Hand(Protocol):
    """An open connection to a hand. Each call but `read_once` and `stop` blocks until its motion has ended.

    A command that fails returns False or raises any exception; so does one that `stop` interrupts.
    """

    def move(self, width: float, speed: float) -> bool:
        """Move to a width."""
        ...

    def grasp(self, width: float, speed: float, force: float, epsilon_inner: float, epsilon_outer: float) -> bool:
        """Close to a width, or until an object resists with a force."""
        ...

    def homing(self) -> bool:
        """Open and close the fingers to find `max_width`."""
        ...

    def stop(self) -> bool:
        """End the command that runs. Without one, take the pressure off a held object."""
        ...

    def read_once(self) -> HandState:
        """Wait for the next state."""
        ...


Opener = Callable[[], Hand]
"""Opens a connection. It may raise any exception."""


def libfranka_opener(device: str, host: str) -> Opener:
    """Return the opener of a real hand. The library is imported when the hand is opened."""

    def open_hand() -> Hand:
        hand: Hand = _library(device).Gripper(host)
        return hand

    return open_hand


def has_module(name: str) -> bool:
    """Whether a module is installed. Does not import it."""
    return importlib.util.find_spec(name) is not None


def _library(device: str) -> Any:
    try:
        return importlib.import_module("panda_py.libfranka")
    except ImportError as error:
        problem = "panda_py is not installed"
        if has_module("pylibfranka"):
            # Its bindings keep the interpreter's lock while a command blocks, so no thread could call stop.
            problem += ", and pylibfranka lets no other thread run during a command"
        remedy = "pip install panda-python, in the version for your robot's libfranka"
        raise ConnectFailed(device, problem, remedy=remedy) from error
