"""Checks of the state that a gripper reports."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

from lsds.contracts.devices import Lifecycle
from lsds.contracts.values import Contact, GripperCommand, GripperState
from lsds.testing.bench import Bench
from lsds.testing.connecting import start_motion, tolerance_m
from lsds.testing.outcomes import Needs

REACTS_S = 0.3
"""Time from a command, a stop or an arrival until the state shows it."""
_SAMPLE_STEP_S = 0.02
"""Time between two reads of the state while the gripper moves, s; chosen."""
_FASTER = 3.0
"""Ratio of two speeds that differ in a short motion, too, although fingers need time to get up to speed; chosen."""
_SLOW_STATES = 5
"""Least number of states under way in which a speed can be measured; chosen."""


def check_gripper_state_is_sound(bench: Bench) -> None:
    """States hold finite apertures (m) within the stroke, `moving` as a bool and `contact` as a `Contact`."""
    with bench.device() as gripper:
        spec = gripper.spec
        for state in bench.samples(gripper, 0.2):
            _assert_sound(state, spec)


def check_gripper_reports_its_motion(bench: Bench) -> None:
    """`moving`, `contact`, `target_m` and the speed of the fingers are those of a motion in the air."""
    _require_motion(bench)
    with bench.device(Lifecycle.ARMED) as gripper:
        spec = gripper.spec
        sent = _to_start(bench, gripper)
        at_rest = bench.read(gripper)
        assert not at_rest.moving, (
            f"moving is true at rest at {at_rest.aperture_m} m; report motion only while it lasts"
        )
        assert at_rest.contact is not Contact.CLOSING, (
            f"contact is closing at rest at {at_rest.aperture_m} m, after it was opened; report an object only while "
            "the fingers press one"
        )
        wide = at_rest.aperture_m > spec.stroke_m / 2
        target = spec.stroke_m * (0.7 if wide else 1.0)
        sent = gripper.command(GripperCommand(target, spec.speed_m_s[0], spec.force_n[0], bench.in_future(10.0)))
        begun_ns = bench.clock.now()
        states = _watched(bench, gripper, abs(target - at_rest.aperture_m))
        under_way = [state for state in states if _between(state, at_rest.aperture_m, sent.aperture_m, gripper)]
        assert under_way, f"no state between {at_rest.aperture_m} m and {sent.aperture_m} m was seen in the motion"
        moving = sum(state.moving for state in under_way)
        assert moving > len(under_way) / 2, (
            f"moving is true in {moving} of {len(under_way)} states of a motion from {at_rest.aperture_m} m to "
            f"{sent.aperture_m} m; report true until the fingers rest"
        )
        late = under_way[len(under_way) // 2 :]
        done = _twice(late, lambda state: not state.moving)
        assert done is None, (
            f"moving is false at {done.aperture_m} m, on the way to {sent.aperture_m} m; report true until the fingers "
            "rest"
        )
        felt = _twice(under_way, lambda state: state.contact is Contact.CLOSING)
        assert felt is None or target > at_rest.aperture_m, (
            f"contact is closing at {felt.aperture_m} m, while the fingers move in the air; report an object only when "
            "it has stopped them"
        )
        targets = sorted(state.target_m for state in under_way)
        typical = targets[len(targets) // 2]
        assert abs(typical - sent.aperture_m) <= tolerance_m(gripper), (
            f"target_m is {typical} m while the fingers move to {sent.aperture_m} m; report the aperture that was sent"
        )
        assert not states[-1].moving, (
            f"moving is still true at {states[-1].aperture_m} m, 2 s after the motion to {sent.aperture_m} m should "
            "have ended; report false at rest"
        )
        _assert_slow(states, begun_ns, at_rest.aperture_m, sent, gripper)
        _assert_speed(bench, gripper, states[-1].aperture_m)


def _twice(states: list[GripperState], what: Callable[[GripperState], bool]) -> GripperState | None:
    """Return the second of two states in a row that are so: one alone may be a flicker of a coarse reading."""
    return next((state for before, state in pairwise(states) if what(before) and what(state)), None)


def _watched(bench: Bench, gripper: Any, way_m: float) -> list[GripperState]:
    """Return the states in the time that a way takes at the least speed, and two seconds more."""
    states = []
    for _ in range(math.ceil((way_m / gripper.spec.speed_m_s[0] + 2.0) / _SAMPLE_STEP_S)):
        bench.advance(_SAMPLE_STEP_S)
        states.append(bench.read(gripper))
        _assert_sound(states[-1], gripper.spec)
    return states


def _assert_slow(states: list[GripperState], begun_ns: int, begun_m: float, sent: GripperCommand, gripper: Any) -> None:
    """Assert that a motion that was sent slow took its time: from the last state near its start to the first one near
    its end."""
    way_m = abs(sent.aperture_m - begun_m)
    near_m = max(2 * tolerance_m(gripper), 0.1 * way_m)
    left_ns = [begun_ns, *(state.t_ns for state in states if abs(state.aperture_m - begun_m) <= near_m)]
    there_ns = [state.t_ns for state in states if abs(state.aperture_m - sent.aperture_m) <= near_m]
    if not there_ns:
        return
    took_s = (there_ns[0] - left_ns[-1]) * 1e-9
    due_s = (way_m - 2 * near_m) / sent.speed_m_s
    assert took_s > due_s / _FASTER, (
        f"the gripper moved by {way_m - 2 * near_m:.3g} m in {took_s:.3g} s after command() returned "
        f"{sent.speed_m_s} m/s; move at the speed that is returned"
    )


def _assert_speed(bench: Bench, gripper: Any, begun_m: float) -> None:
    """Move at the greatest speed: fingers that are as fast are seen under way at most a few times."""
    spec = gripper.spec
    target = spec.stroke_m * (1.0 if begun_m < 0.9 * spec.stroke_m else 0.7)
    sent = gripper.command(GripperCommand(target, spec.speed_m_s[1], spec.force_n[0], bench.in_future(10.0)))
    # A state that is read twice is one.
    seen = sorted(
        {
            state.t_ns: state.aperture_m
            for state in _watched(bench, gripper, abs(target - begun_m))
            if _between(state, begun_m, sent.aperture_m, gripper)
        }.items()
    )
    if len(seen) < _SLOW_STATES:
        return
    (begun_ns, first_m), (ended_ns, last_m) = seen[0], seen[-1]
    speed = abs(last_m - first_m) / max((ended_ns - begun_ns) * 1e-9, _SAMPLE_STEP_S)
    assert speed > sent.speed_m_s / _FASTER, (
        f"the gripper moves at {speed:.3g} m/s after command() returned {sent.speed_m_s} m/s; return the speed sent"
    )


def check_gripper_stops(bench: Bench) -> None:
    """`stop` ends a motion of the fingers where they are."""
    _require_motion(bench)
    with bench.device(Lifecycle.ARMED) as gripper:
        _to_start(bench, gripper)
        start_motion(bench, gripper)
        bench.advance(REACTS_S)
        stopped, later = _stopped(bench, gripper)
        assert abs(later - stopped) <= tolerance_m(gripper), (
            f"the fingers move on after stop(): from {stopped} m to {later} m in 0.5 s; end the motion in stop()"
        )
        # A command that is still under way must not start them again.
        start_motion(bench, gripper)
        stopped, later = _stopped(bench, gripper)
        assert abs(later - stopped) <= tolerance_m(gripper), (
            f"after a command and stop() right behind it the fingers move from {stopped} m to {later} m in 0.5 s; let "
            "stop() end what is under way, too"
        )


def _stopped(bench: Bench, gripper: Any) -> tuple[float, float]:
    """Call `stop`; return the aperture (m) once the gripper has reacted, and half a second later."""
    gripper.stop()
    bench.advance(REACTS_S)
    stopped: float = bench.read(gripper).aperture_m
    bench.advance(0.5)
    return stopped, bench.read(gripper).aperture_m


def _to_start(bench: Bench, gripper: Any) -> GripperCommand:
    """Open the gripper, so that the next motion has room, and wait until it rests."""
    spec = gripper.spec
    sent: GripperCommand = gripper.command(
        GripperCommand(spec.stroke_m, spec.speed_m_s[1], spec.force_n[0], bench.in_future(10.0))
    )
    bench.settle(lambda: abs(bench.read(gripper).aperture_m - sent.aperture_m) <= tolerance_m(gripper), 5.0)
    bench.advance(REACTS_S)
    return sent


def _between(state: GripperState, start_m: float, end_m: float, gripper: Any) -> bool:
    """Whether a state is well under way: away from both ends."""
    low, high = sorted((start_m, end_m))
    margin = max(2 * tolerance_m(gripper), 0.1 * (high - low))
    return low + margin < state.aperture_m < high - margin


def _assert_sound(state: Any, spec: Any) -> None:
    assert isinstance(state, GripperState), f"read() returned {type(state).__name__}; return a GripperState"
    room = 2 * spec.resolution_m + 0.05 * spec.stroke_m
    for name in ("aperture_m", "target_m"):
        value = getattr(state, name)
        assert math.isfinite(value), f"{name} is {value}; raise StaleData if it is not known"
        assert -room <= value <= spec.stroke_m + room, (
            f"{name} is {value}, outside of the stroke of 0 to {spec.stroke_m} m; report metres"
        )
    assert isinstance(state.moving, bool), f"moving is {state.moving!r}; report a bool"
    assert isinstance(state.contact, Contact), f"contact is {state.contact!r}; report a Contact"


def _require_motion(bench: Bench) -> None:
    if not bench.may_move:
        raise Needs("motion")


GRIPPER_STATE_CHECKS = (check_gripper_state_is_sound, check_gripper_reports_its_motion, check_gripper_stops)
