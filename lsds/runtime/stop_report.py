"""The state of arm and gripper, as far as it is known, after an error has ended a run.

The report claims nothing that was not measured: a device that sends no state may still be moving.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from lsds.clock import seconds
from lsds.errors import UNREACHABLE, CallHangs
from lsds.safety.device_calls import call_of

if TYPE_CHECKING:
    from lsds.runtime.actuation import Actuation
    from lsds.runtime.device_states import States
    from lsds.runtime.rig import Rig


def stop_report(
    error: BaseException,
    rig: Rig,
    states: States,
    act: Actuation,
    problems: Sequence[str],
    now_ns: int,
) -> str:
    """Return one line on the arm and the gripper, "" for a rig without either.

    `problems` are those that `Rig.stop` returned.
    """
    failed = ""
    if isinstance(error, CallHangs):
        failed = error.device
    elif isinstance(error, UNREACHABLE) and (call := call_of(error)) is not None:
        failed = call.who
    parts = []
    for kind, device, describe in (("arm", rig.arm, _arm), ("gripper", rig.gripper, _gripper)):
        if device is None:
            continue
        silence_s = states.silence_s(kind, now_ns)
        why = next((problem for problem in problems if problem.startswith(f"{kind} ")), "")
        if failed.startswith(f"{kind} "):
            why = "its connection failed"
        elif silence_s > 0:
            why = f"no usable state for {silence_s:.2f} s"
        parts += [describe(why, act, now_ns), str(getattr(device, "stop_result", ""))]
    return "; ".join(part for part in parts if part)


def _arm(unreachable: str, act: Actuation, now_ns: int) -> str:
    if not unreachable:
        return "the arm was commanded to stop"
    last = "it was sent no motion"
    if act.moved_ns is not None:
        speed, age_s = math.hypot(*act.moving.linear_m_s), seconds(now_ns - act.moved_ns)
        turn = math.hypot(*act.moving.angular_rad_s)
        rates = f"{speed:.3f} m/s" + (f", {turn:.3f} rad/s" if turn > 0 else "")
        last = f"its last command was {rates}, {age_s:.2f} s before the stop"
    return f"the arm could not be reached ({unreachable}), so it may still be moving; {last}"


def _gripper(unreachable: str, act: Actuation, now_ns: int) -> str:
    held = f"its last command was {1e3 * act.held_m:.2f} mm" if math.isfinite(act.held_m) else "it was sent no command"
    if unreachable:
        return f"the gripper could not be reached ({unreachable}): {held}"
    return f"the gripper was commanded to stay where it is: {held}"
