"""Action servers."""

from __future__ import annotations

import threading
from collections.abc import Callable
from enum import Enum
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node


class GoalResponse(Enum):
    """Answer to a goal."""

    REJECT = 1
    ACCEPT = 2


class CancelResponse(Enum):
    """Answer to a cancellation."""

    REJECT = 1
    ACCEPT = 2


class ServerGoalHandle:
    """A goal that runs in its own thread."""

    def __init__(self, request: Any, execute: Callable[[ServerGoalHandle], Any]) -> None:
        self.request = request
        self.is_cancel_requested = False
        self.status = "executing"
        self.standin_result: Any = None
        self.standin_feedback: list[Any] = []
        self._execute = execute
        self.standin_thread = threading.Thread(target=self._run, daemon=True)

    def _run(self) -> None:
        self.standin_result = self._execute(self)

    def publish_feedback(self, feedback: Any) -> None:
        """Send feedback."""
        self.standin_feedback.append(feedback)

    def succeed(self) -> None:
        """End with success."""
        self._end("succeeded")

    def abort(self) -> None:
        """End with failure."""
        self._end("aborted")

    def canceled(self) -> None:
        """End because the client asked for it."""
        assert self.is_cancel_requested
        self._end("canceled")

    def _end(self, status: str) -> None:
        assert self.status == "executing"
        self.status = status


class ActionServer:
    """Takes goals of one action."""

    def __init__(
        self,
        node: Node,
        action_type: type,
        action_name: str,
        execute_callback: Callable[[ServerGoalHandle], Any],
        *,
        callback_group: ReentrantCallbackGroup,
        goal_callback: Callable[[Any], GoalResponse],
        cancel_callback: Callable[[Any], CancelResponse],
    ) -> None:
        self._type, self._execute = action_type, execute_callback
        self._accepts, self._cancels = goal_callback, cancel_callback

    def standin_send(self, goal: Any) -> ServerGoalHandle | None:
        """Send a goal as a client does; return its handle, None if it is refused."""
        if self._accepts(goal) is GoalResponse.REJECT:
            return None
        handle = ServerGoalHandle(goal, self._execute)
        handle.standin_thread.start()
        return handle

    def standin_cancel(self, handle: ServerGoalHandle) -> None:
        """Cancel a goal as a client does."""
        handle.is_cancel_requested = self._cancels(handle) is CancelResponse.ACCEPT

    def destroy(self) -> None:
        """End the server."""
