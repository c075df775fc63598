"""Findings of a trial: hang, crash, blocked calls, wrong values, opening, running on; and the time to recover."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from lsds.clock import NS_PER_S, nanoseconds
from lsds.testing.mock_handle import OPENED_BY_COMMAND_M, Truth
from lsds.testing.torture.course import RIGHT, STOPS_S, Course
from lsds.testing.torture.driven import Call

STALE_ANSWER_S = 0.3
"""An answer may describe the device as it was at most so long before the call (s): longer than the longest delay of a
fault, 0.25 s."""
BLOCKED_S = 1.0
"""A call that takes longer keeps its program from reacting (s): an object falls 5 m in it."""
TOLERANCE_M = 1.0e-3
"""Greatest error of an aperture or a height (m): four position ticks of a Hand-E."""
IMAGE_LEVELS = 12.0
"""Greatest RMS difference of an image of an unchanged scene, grey levels; noise and JPEG leave less than 2."""
CHECKED = ("pty", "tcp")
"""Faces whose messages have a checksum."""
LIES = ("freeze", "black-frame")
"""Faults in which a device sends a well-formed message with a wrong value, which no client can notice."""

LATCHED = ("gripper-fault", "protective-stop", "emergency-stop")
"""Faults that outlast their cause until the client resets the device: until then it follows no command."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding: its kind, and what happened in one sentence."""

    kind: str
    text: str


def is_right(course: Course, call: Call) -> bool:
    """Return whether an answer is right: it agrees with the device at some time in `STALE_ANSWER_S` before its end."""
    return not (call.error or call.ending) and _error(course, call) == ""


def findings(course: Course) -> list[Finding]:
    """Return what is to be said against the client, worst first."""
    found = []
    for call in course.calls:
        if call.ending == "hang":
            found.append(Finding("hang", f"{call.name}() did not return within {call.lasted_s:.1f} s"))
        elif call.ending:
            where = f"in {call.name}()" if call.name else "between two calls"
            found.append(Finding("crash", f"its process {call.ending}, {where}"))
    slow = [call for call in course.calls if not call.ending and call.name != "connect" and call.lasted_s > BLOCKED_S]
    if slow:
        longest = max(slow, key=lambda call: call.lasted_s)
        found.append(Finding("blocked", f"{longest.name}() took {longest.lasted_s:.1f} s{_times(len(slow))}"))
    if opened := _opened(course):
        found.append(Finding("opened", opened))
    if course.moves_on:
        last = course.calls[-1]
        after = "the client ended" if last.name != "stop" or last.ending else "stop() returned"
        found.append(Finding("ran on", f"the arm still moved {STOPS_S:g} s after {after}"))
    wrong = [(call, text) for call in course.calls if (text := _wrong(course, call))]
    if wrong:
        found.append(Finding("wrong value", f"{wrong[0][1]}{_times(len(wrong))}"))
    if course.followed is False and not found and course.case.fault not in LATCHED:
        found.append(Finding("did not follow", "after the fault, move() returned and the fingers did not move"))
    return found


def _times(count: int) -> str:
    return f" ({count} times)" if count > 1 else ""


def recovery_s(course: Course) -> float | None:
    """Return the time from the fault's end to the first of `RIGHT` right answers in a row; None if there were none."""
    reads = [call for call in course.calls if call.name == "read" and call.ended_ns > course.fault_ns[1]]
    for first in range(len(reads) - RIGHT + 1):
        if all(is_right(course, call) for call in reads[first : first + RIGHT]):
            return max(0.0, (reads[first].ended_ns - course.fault_ns[1]) / NS_PER_S)
    return None


def _wrong(course: Course, call: Call) -> str:
    """Return what is wrong with the answer of a read, "" if nothing is or no client could know."""
    if call.name != "read" or call.error or call.ending or call.began_ns < course.moved_from_ns:
        return ""
    begins, ends = course.fault_ns
    lies = course.case.fault in LIES or (course.case.fault == "corrupt" and course.transport not in CHECKED)
    if lies and begins <= call.ended_ns <= ends + nanoseconds(STALE_ANSWER_S):
        return ""
    return _error(course, call)


def _error(course: Course, call: Call) -> str:
    """Return how an answer differs from the device, "" if it does not."""
    if course.case.kind == "sensor":
        return _image_error(course, call)
    if isinstance(call.value, bool) or not isinstance(call.value, (int, float)):
        return f"read() returned {call.value!r}"
    if not math.isfinite(call.value):
        return f"read() returned {call.value}"
    true_m = [_position_m(truth) for truth in _near(course.truths, call)]
    if not true_m or min(true_m) - TOLERANCE_M <= call.value <= max(true_m) + TOLERANCE_M:
        return ""
    return f"read() returned {1e3 * call.value:.1f} mm, the device was at {_range_mm(min(true_m), max(true_m))}"


def _image_error(course: Course, call: Call) -> str:
    reference: dict[str, Any] = course.reference
    if not isinstance(call.value, dict):
        return f"read() returned {call.value!r}"
    if call.value["size"] != reference["size"]:
        return f"read() returned an image of {call.value['size']}, not {reference['size']}"
    squares = [
        (one - other) ** 2
        for row, true in zip(call.value["grey"], reference["grey"], strict=True)
        for one, other in zip(row, true, strict=True)
    ]
    difference = math.sqrt(sum(squares) / len(squares))
    return "" if difference <= IMAGE_LEVELS else f"read() returned an image that is off by {difference:.0f} grey levels"


def _near(truths: list[Truth], call: Call) -> list[Truth]:
    """Return the states of the device from `STALE_ANSWER_S` before a call to its end, with the ones next to these."""
    from_ns = call.began_ns - nanoseconds(STALE_ANSWER_S)
    before = [truth for truth in truths if truth.t_ns < from_ns]
    within = [truth for truth in truths if from_ns <= truth.t_ns <= call.ended_ns]
    after = [truth for truth in truths if truth.t_ns > call.ended_ns]
    return [*before[-1:], *within, *after[:1]]


def _position_m(truth: Truth) -> float:
    return float(truth["aperture_m"]) if "aperture_m" in truth else float(truth["pose"][2])


def _range_mm(low_m: float, high_m: float) -> str:
    low, high = f"{1e3 * low_m:.1f}", f"{1e3 * high_m:.1f}"
    return f"{low} mm" if low == high else f"{low} to {high} mm"


def _opened(course: Course) -> str:
    """Return how far a gripper opened without a command to open, "" if it did not."""
    if course.case.kind != "gripper" or course.broken:
        return ""
    least = math.inf
    for truth in course.truths:
        if not course.moved_from_ns <= truth.t_ns <= course.ends_ns:
            continue
        if truth.aperture_m > least + OPENED_BY_COMMAND_M:
            after_s = (truth.t_ns - course.fault_ns[0]) / NS_PER_S
            apertures = f"{least * 1e3:.1f} to {truth.aperture_m * 1e3:.1f} mm"
            return f"the fingers opened from {apertures}, {after_s:.2f} s after the fault began"
        least = min(least, truth.aperture_m)
    return ""
