"""Checks that connecting to a gripper or an arm moves nothing, and that closing ends its motion."""

from __future__ import annotations

import math
from typing import Any

from lsds.contracts.devices import Lifecycle
from lsds.contracts.values import ArmCommand, GripperCommand, Twist
from lsds.errors import LsdsError
from lsds.testing.bench import Bench
from lsds.testing.outcomes import Needs, NotApplicable

WATCHED_S = 1.0
"""Time for which a device must not move, s."""
_BRAKE_S = 0.3
"""Time that a device gets to move or to brake, s; chosen."""
STANDS_M = 1e-5
"""Minimum motion of a device that has moved, m."""


def check_connect_moves_nothing(bench: Bench) -> None:
    """`connect` moves nothing: the device stays where it was, also when it is not at its start."""
    with bench.device() as device:
        _assert_rests(bench, device, "after connect()")
    if not bench.may_move:
        return
    with bench.device(Lifecycle.ARMED) as device:
        start_motion(bench, device)
        bench.advance(_BRAKE_S)
        device.stop()
        bench.advance(_BRAKE_S)
        before = place(bench, device)
        if not bench.virtual:
            device.close()
        second = bench.build_beside()
        try:
            second.connect()
            watched = device if bench.virtual else second
            _assert_rests(bench, watched, "after connect() of a second device", before)
        except LsdsError as error:
            if bench.virtual:
                raise NotApplicable(f"a second device does not connect next to the first: {error}") from error
            raise
        finally:
            second.close()


def check_close_ends_motion(bench: Bench) -> None:
    """`close` ends motion and keeps the grip: no gripper opens, and no arm goes on."""
    if not bench.may_move:
        raise Needs("motion")
    with bench.device(Lifecycle.ARMED) as device:
        watcher = beside(bench, device)
        try:
            start_motion(bench, device)
            bench.advance(_BRAKE_S)
            before = place(bench, device)
            device.close()
            watcher = watcher or beside_closed(bench)
            bench.advance(_BRAKE_S)
            after = place(bench, watcher)
            bench.advance(WATCHED_S)
            last = place(bench, watcher)
        finally:
            if watcher is not None:
                watcher.close()
    if bench.kind == "gripper":
        assert last[0] <= before[0] + tolerance_m(device), f"close() opened the gripper from {before[0]} to {last[0]} m"
    moved = math.dist(after, last)
    assert moved <= tolerance_m(device), (
        f"{WATCHED_S} s after close() the device has moved on by {moved * 1e3:.1f} mm; stop it in close()"
    )


def start_motion(bench: Bench, device: Any) -> None:
    """Command a slow motion of seconds: a gripper closes, an arm rises."""
    if bench.kind == "gripper":
        spec = device.spec
        device.command(GripperCommand(0.0, spec.speed_m_s[0], spec.force_n[0], bench.in_future(10.0)))
    else:
        device.command(ArmCommand(Twist((0.0, 0.0, 0.02)), 0.5, bench.in_future(10.0)))


def place(bench: Bench, device: Any) -> tuple[float, ...]:
    """Return the position of the device: the aperture, or the position of the TCP (m)."""
    state = bench.read(device)
    return (state.aperture_m,) if bench.kind == "gripper" else tuple(state.tcp_pose.position_m)


def tolerance_m(device: Any) -> float:
    """Return the largest motion (m) of a device at rest."""
    return 2 * getattr(device.spec, "resolution_m", 0.0) + 5e-4


def beside(bench: Bench, device: Any) -> Any:
    """Return a second, connected device of a simulated cell; None on hardware.

    Raises NotApplicable if it cannot connect, or does not report the motion of the first one.
    """
    if not bench.virtual:
        return None
    start = place(bench, device)
    second = bench.build_beside()
    try:
        second.connect()
        start_motion(bench, device)
        bench.advance(_BRAKE_S)
        device.stop()
        bench.advance(_BRAKE_S)
        if math.dist(start, place(bench, device)) < STANDS_M:
            raise NotApplicable(
                "the device does not move any more once a second one was built in its cell; let both move the same "
                "fingers (context.shared)"
            )
        apart = math.dist(place(bench, device), place(bench, second))
    except NotApplicable:
        second.close()
        raise
    except LsdsError as error:
        second.close()
        raise NotApplicable(f"a second device does not connect next to the first: {error}") from error
    if apart > tolerance_m(device):
        second.close()
        raise NotApplicable("a second device of the same cell does not see the motion of the first")
    return second


def beside_closed(bench: Bench) -> Any:
    """Return a second, connected device after the first has been closed."""
    second = bench.build_beside()
    second.connect()
    return second


def _assert_rests(bench: Bench, device: Any, when: str, before: tuple[float, ...] | None = None) -> None:
    start = before or place(bench, device)
    for _ in range(10):
        now = place(bench, device)
        moved = math.dist(start, now)
        assert moved <= tolerance_m(device), (
            f"{when} the device has moved by {moved * 1e3:.1f} mm, from {start} to {now}; only arm() may move"
        )
        bench.advance(WATCHED_S / 10)


CONNECTING_CHECKS = (check_connect_moves_nothing, check_close_ends_motion)
