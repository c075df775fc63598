"""Tracebacks that hold nothing but lines.

The traceback of an exception holds the local variables of every function that it passed, and those of their callers.
Where one of these refers to the exception, they keep each other alive until Python's next full collection: after a run
that ended with an error that is the whole cell, some 40 MB.
"""

from __future__ import annotations

from collections import deque
from types import FrameType


def forget_locals(error: BaseException | None) -> None:
    """Clear the local variables of all functions that have ended, in the tracebacks of an exception, of its causes and
    of its members. Files, lines and names stay."""
    waiting, seen = deque([error]), set[int]()
    while waiting:
        each = waiting.popleft()
        if each is None or id(each) in seen:
            continue
        seen.add(id(each))
        passed = each.__traceback__
        while passed is not None:
            _clear(passed.tb_frame)
            passed = passed.tb_next
        waiting += [each.__cause__, each.__context__]
        if isinstance(each, BaseExceptionGroup):
            waiting += each.exceptions


def _clear(frame: FrameType | None) -> None:
    """Clear a frame and its callers up to the first that is still executed."""
    while frame is not None:
        try:
            frame.clear()
        except RuntimeError:
            return
        frame = frame.f_back
