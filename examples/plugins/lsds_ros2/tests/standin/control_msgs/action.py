"""The action of a gripper."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class _Command:
    position: float = 0.0
    max_effort: float = 0.0


@dataclass
class _Goal:
    command: _Command = field(default_factory=_Command)


@dataclass
class _State:
    position: float = 0.0
    effort: float = 0.0
    stalled: bool = False
    reached_goal: bool = False


class GripperCommand:
    """Goal, result and feedback."""

    Goal = _Goal
    Result = _State
    Feedback = _State
