"""The register machine: activation, motion, contact, release, faults; and that it never opens unasked."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.wire.robotiq.rig import Bench

GO, RELEASE, RELEASE_OPENING = 0x09, 0x11, 0x31


def stroke_s(bench, position, speed):
    """How long the fingers take to the end, by their position register."""
    bench.write(GO, position, speed)
    start = bench.clock.now()
    while bench.obj == 0:
        bench.wait(0.001, step_s=0.001)
        assert bench.clock.now() - start < 20e9
    return (bench.clock.now() - start) * 1e-9


@pytest.mark.parametrize("speed", [0, 64, 128, 255])
def test_stroke_times(speed):
    bench = Bench(activated=True)
    expected = 50 / (20 + 130 * speed / 255)
    assert stroke_s(bench, 255, speed) == pytest.approx(expected, rel=0.05)
    assert bench.tick == 228
    assert stroke_s(bench, 0, speed) == pytest.approx(expected, rel=0.05)
    assert bench.tick == 3


def test_activation_closes_and_opens_and_then_is_active():
    bench = Bench(activation_s=1.2)
    bench.write(1)
    seen = []
    for _ in range(400):
        bench.wait(0.005)
        seen.append((bench.sta, bench.tick))
    assert {sta for sta, _ in seen} == {1, 3}
    assert max(tick for _, tick in seen) == 228
    assert seen[-1] == (3, 3)
    active = next(i for i, (sta, _) in enumerate(seen) if sta == 3)
    assert 1.2 <= 0.005 * (active + 1) <= 1.3
    assert bench.obj == 0, "gOBJ has no meaning before a motion was asked for"


def test_activation_is_quicker_only_than_its_least_time_where_it_begins_closed():
    bench = Bench(activation_s=1.2, aperture_mm=0.1)
    bench.write(1)
    bench.wait(1.15)
    assert bench.sta == 1
    bench.wait(0.1)
    assert bench.sta == 3


def test_an_object_in_the_way_fails_the_activation_until_a_reset():
    bench = Bench(object_mm=30, object_stays=True)
    bench.write(1)
    bench.wait(2)
    assert (bench.sta, bench.flt) == (0, 0x0D)
    bench.write(GO, 255)
    bench.wait(0.2)
    assert bench.flt == 0x0D, "a command does not clear it"
    bench.write(0)
    assert bench.flt == 0


@pytest.mark.parametrize("again", [False, True])
def test_an_object_is_put_between_the_fingers_when_they_are_active(again):
    bench = Bench(object_mm=30, activation_s=1.2)
    for _ in range(1 + again):
        bench.write(0)
        bench.write(1)
        bench.wait(1.5)
        assert (bench.sta, bench.flt, bench.tick) == (3, 0, 3), "it closes and opens with nothing in its way"
        bench.write(GO, 255)
        bench.wait(1)
        assert (bench.obj, bench.flt) == (2, 0)
        assert bench.fingers.fingers().aperture_m == pytest.approx(0.030, abs=2e-3)


def test_an_object_around_the_fingers_is_put_there_when_it_has_room():
    bench = Bench(hollow_mm=30, activation_s=1.2)
    bench.write(1)
    bench.wait(1.5)
    assert (bench.sta, bench.flt, bench.tick) == (3, 0, 3)
    bench.write(GO, 255)
    bench.wait(1)
    assert bench.obj == 3
    bench.write(GO, 0)
    bench.wait(1)
    assert bench.obj == 1
    assert bench.fingers.fingers().aperture_m == pytest.approx(0.030, abs=2e-3)


def test_a_motion_asked_for_during_activation_is_delayed():
    bench = Bench()
    bench.write(GO, 100)
    assert (bench.sta, bench.flt) == (1, 5)
    bench.wait(1.7)
    assert (bench.sta, bench.flt, bench.tick) == (3, 0, 100)


def test_a_motion_before_activation_is_refused():
    bench = Bench()
    bench.write(0x08, 200)
    bench.wait(0.5)
    assert (bench.flt, bench.tick, bench.status[3]) == (7, 3, 200)


def test_contact_while_closing_and_the_force_that_decides_it():
    bench = Bench(activated=True, object_mm=30)
    bench.write(GO, 255, force=0)
    bench.wait(1)
    assert bench.obj == 2
    light = bench.tick
    bench.write(GO, 255, force=255)
    assert bench.obj == 0, "a new request is under way"
    bench.wait(1)
    assert bench.obj == 2
    assert bench.tick > light, "more force presses in further"


def test_the_same_request_again_is_no_new_one():
    bench = Bench(activated=True, object_mm=30)
    bench.write(GO, 255, force=10)
    bench.wait(1)
    bench.write(GO, 255, force=10)
    assert bench.obj == 2


def test_contact_while_opening():
    bench = Bench(activated=True, hollow_mm=30, aperture_mm=10)
    bench.write(GO, 0)
    bench.wait(1)
    assert bench.obj == 1
    bench.write(GO, 200)
    bench.wait(1)
    assert bench.obj == 3


def test_taking_go_to_away_stops_at_once_and_stays():
    bench = Bench(activated=True)
    bench.write(GO, 255, 0)
    bench.wait(1)
    bench.write(0x01)
    stopped = bench.tick
    bench.wait(2)
    assert stopped == bench.tick
    assert 3 < stopped < 228
    bench.write(GO)
    bench.wait(3)
    assert bench.tick == 228, "the request is still there"


@pytest.mark.parametrize(("action", "end"), [(RELEASE, 228), (RELEASE_OPENING, 3)])
def test_automatic_release_is_slow_and_needs_a_reset(action, end):
    bench = Bench(activated=True, aperture_mm=25)
    bench.write(action)
    bench.wait(0.1)
    assert (bench.sta, bench.flt) == (0, 0x0B)
    assert abs(bench.tick - 116) < 12
    bench.write(GO, 116)
    bench.wait(1.5)
    assert (bench.sta, bench.flt, bench.tick) == (0, 0x0F, end)
    bench.write(0)
    bench.write(1)
    bench.wait(1.7)
    assert (bench.sta, bench.flt) == (3, 0)


@pytest.mark.parametrize("code", [0x0A, 0x0C, 0x0D, 0x0E, 0x0F, 0x3C])
def test_faults_that_need_a_reset(code):
    bench = Bench(activated=True)
    bench.write(GO, 255, 0)
    bench.wait(0.5)
    bench.machine.fail(code, bench.clock.now())
    held = bench.tick
    bench.write(GO, 200)
    bench.wait(1)
    assert (bench.flt, bench.sta, bench.tick) == (code, 0, held)
    bench.write(0)
    bench.write(1)
    bench.wait(1.7)
    assert (bench.flt, bench.sta) == (0, 3)


def test_heat_stops_it_until_it_is_cool():
    bench = Bench(activated=True)
    bench.write(GO, 255, 0)
    bench.wait(0.5)
    bench.machine.fail(8, bench.clock.now())
    held = bench.tick
    bench.wait(0.3)
    assert (bench.flt, bench.tick) == (8, held)
    bench.wait(3)
    assert (bench.flt, bench.tick) == (0, 228)


def test_silence_is_reported_to_the_first_request_after_it():
    bench = Bench(activated=True)
    bench.ask("09 03 07 D0 00 03 04 0E")
    bench.wait(1.5)
    assert bench.ask("09 03 07 D0 00 03 04 0E").split()[5] == "09"
    bench.wait(0.01)
    assert bench.ask("09 03 07 D0 00 03 04 0E").split()[5] == "00"


@pytest.mark.parametrize("code", [1, 2, 3, 4, 6])
def test_codes_that_there_are_not(code):
    with pytest.raises(ValueError):
        Bench().machine.fail(code, 0)


def test_frozen_registers_neither_change_nor_obey():
    bench = Bench(activated=True)
    bench.write(GO, 255, 0)
    bench.wait(0.5)
    frozen = bench.status
    bench.machine.freeze(bench.clock.now() + 10**9)
    bench.write(GO, 10, 255)
    bench.wait(0.9)
    assert bench.status == frozen
    bench.wait(0.2)
    assert bench.machine.command[3] == 255


def test_a_latency_delays_motions_and_loses_none():
    bench = Bench(activated=True, latency_ms=40)
    for position in range(100, 120):
        bench.write(GO, position)
        bench.wait(0.01)
    assert bench.obj == 0
    bench.wait(0.02)
    assert bench.tick > 60, "a stream of commands does not starve"
    bench.wait(1)
    assert (bench.tick, bench.obj) == (119, 3)


WRITES = st.tuples(
    st.sampled_from([0, 1, 8, 9, 9, 9, 9, 0x11, 0x31, 0x39]),
    st.integers(0, 255),
    st.integers(0, 255),
    st.integers(0, 255),
    st.floats(0.001, 0.6),
)


@given(
    st.lists(WRITES, max_size=12),
    st.sampled_from([None, 12.0, 30.0]),
    st.booleans(),
    st.lists(st.sampled_from([0, 0, 0, 8, 0x0A, 0x0E, 0x0F]), min_size=12, max_size=12),
)
@settings(max_examples=40)
def test_it_opens_only_on_command(writes, object_mm, activated, faults):
    bench = Bench(activated=activated, object_mm=object_mm)
    for (action, position, speed, force, wait_s), fault in zip(writes, faults, strict=False):
        before_m, before_tick = bench.fingers.fingers().aperture_m, bench.tick
        bench.write(action, position, speed, force)
        if fault:
            bench.machine.fail(fault, bench.clock.now())
        activates = releases = False
        for _ in range(steps := math.ceil(wait_s / 0.02)):
            activates |= bench.sta == 1
            releases |= bench.flt == 0x0B
            bench.wait(wait_s / steps)
            check_status(bench)
        asks = action & GO == GO and position <= before_tick
        opened = bench.fingers.fingers().aperture_m > before_m + 1e-9
        assert not opened or asks or activates or releases


def check_status(bench):
    """Assert the invariants of the status block."""
    status = bench.status
    act, gto, sta, obj = status[0] & 1, status[0] >> 3 & 1, status[0] >> 4 & 3, status[0] >> 6
    assert len(status) == 16
    assert not any(status[6:])
    assert status[1] == 0
    assert sta in (0, 1, 3)
    assert act or sta == 0, "nothing is active that is not activated"
    assert status[3] == bench.machine.command[3], "gPR echoes the request"
    assert bench.options.open_tick <= status[4] <= bench.options.closed_tick
    if obj:
        assert gto, "gOBJ only means something while going"
        assert sta == 3
    if obj == 3:
        wanted = min(max(status[3], bench.options.open_tick), bench.options.closed_tick)
        assert abs(status[4] - wanted) <= 1
    if status[2] & 0x0F in (0x0A, 0x0B, 0x0C, 0x0D, 0x0E, 0x0F):
        assert sta == 0
