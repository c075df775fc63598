"""Nodes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from rclpy.time import Time
from rclpy.world import PARAMETERS, TOPICS


class Clock:
    """The system's clock."""

    def now(self) -> Time:
        """Return the present time."""
        return Time(nanoseconds=time.time_ns())


class Logger:
    """Keeps what is logged."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def warning(self, text: str, **_: Any) -> None:
        """Log a warning."""
        self.lines.append(f"warning: {text}")

    def error(self, text: str, **_: Any) -> None:
        """Log an error."""
        self.lines.append(f"error: {text}")


@dataclass
class Publisher:
    """Sends messages of one type to a topic."""

    kind: type
    topic: str

    def publish(self, message: Any) -> None:
        """Call every subscriber."""
        assert type(message) is self.kind
        for callback in TOPICS.get(self.topic, []):
            callback(message)


@dataclass
class Timer:
    """Calls a function at a period, s."""

    period_s: float
    callback: Callable[[], None]


class Node:
    """A node with publishers, subscribers and timers."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._clock, self._logger = Clock(), Logger()
        self.standin_timers: list[Timer] = []

    def get_clock(self) -> Clock:
        """Return the clock."""
        return self._clock

    def get_logger(self) -> Logger:
        """Return the logger."""
        return self._logger

    def create_publisher(self, kind: type, topic: str, qos: int) -> Publisher:
        """Return a publisher."""
        return Publisher(kind, self._full(topic))

    def create_subscription(self, kind: type, topic: str, callback: Callable[[Any], None], qos: int) -> None:
        """Call a function with each message of a topic."""
        TOPICS.setdefault(self._full(topic), []).append(callback)

    def create_timer(self, period_s: float, callback: Callable[[], None]) -> Timer:
        """Call a function at a period."""
        self.standin_timers.append(Timer(period_s, callback))
        return self.standin_timers[-1]

    def declare_parameter(self, name: str, default: Any) -> Any:
        """Return the parameter."""
        return SimpleNamespace(value=PARAMETERS.get(name, default))

    def destroy_node(self) -> None:
        """End the node."""
        self.standin_timers.clear()

    def _full(self, topic: str) -> str:
        return topic.replace("~", f"/{self._name}")
