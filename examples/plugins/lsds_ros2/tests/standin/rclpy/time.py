"""Times of ROS."""

from __future__ import annotations

from builtin_interfaces import msg


class Time:
    """A time in nanoseconds since 1970."""

    def __init__(self, *, seconds: int = 0, nanoseconds: int = 0) -> None:
        self.nanoseconds = seconds * 1_000_000_000 + nanoseconds

    @classmethod
    def from_msg(cls, message: msg.Time) -> Time:
        """Return the time of a message."""
        return cls(seconds=message.sec, nanoseconds=message.nanosec)

    def to_msg(self) -> msg.Time:
        """Return the time as a message."""
        sec, nanosec = divmod(self.nanoseconds, 1_000_000_000)
        return msg.Time(sec, nanosec)
