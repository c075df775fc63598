import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_mocks.devices.hand_e_units import FORCE_N, SPEED_RANGE_M_S, HandEUnits, from_byte, to_byte
from mock_rig import FAR, MS, STRONG_M, make_rig

from lsds.contracts import Contact, Gripper, GripperCommand, Lifecycle
from lsds.errors import CommandExpired, LifecycleError, LimitExceeded

UNITS = HandEUnits(0.05, 3, 228)


def test_it_is_a_gripper():
    gripper = make_rig().gripper
    assert isinstance(gripper, Gripper)
    assert gripper.spec.resolution_m == pytest.approx(0.2222e-3, rel=1e-3)
    assert gripper.spec.stroke_m == 0.05


@given(st.floats(0, 0.05))
def test_ticks_are_the_nearest(aperture):
    assert abs(UNITS.aperture_m(UNITS.tick(aperture)) - aperture) <= UNITS.metres_per_tick / 2 + 1e-12


def test_end_ticks():
    assert UNITS.tick(0.05) == UNITS.tick(1.0) == 3
    assert UNITS.tick(0.0) == UNITS.tick(-1.0) == 228


@given(st.integers(0, 255))
def test_bytes_survive_the_round_trip(byte):
    assert to_byte(from_byte(byte, SPEED_RANGE_M_S), SPEED_RANGE_M_S) == byte
    assert to_byte(from_byte(byte, FORCE_N), FORCE_N) == byte


def test_command_returns_what_was_really_sent():
    rig = make_rig()
    sent = rig.grip(0.0243, speed=1.0, force=5.0)
    assert sent.aperture_m == pytest.approx(0.05 / 225 * round(0.0243 / (0.05 / 225)))
    assert sent.speed_m_s == 0.150
    assert sent.force_n == 20.0
    assert rig.grip(sent.aperture_m).aperture_m == sent.aperture_m


def test_motion_starts_after_the_latency_and_goes_at_the_speed_sent():
    rig = make_rig()
    rig.until(100)
    sent = rig.grip(0.03, speed=0.05)
    trace = []
    for t_ms in range(100, 700, 5):
        rig.until(t_ms)
        state = rig.gripper.read()
        trace.append((state.t_ns / 1e6, state.aperture_m, state.moving))
    start = next(t for t, aperture, _ in trace if aperture < 0.05 - 1e-9)
    assert 135 <= start <= 155
    t, aperture, moving = (np.array(column) for column in zip(*trace, strict=True))
    middle = (aperture < 0.045) & (aperture > 0.035)
    assert -np.polyfit(t[middle] / 1e3, aperture[middle], 1)[0] == pytest.approx(sent.speed_m_s, rel=0.03)
    assert aperture[-1] == pytest.approx(0.03, abs=0.12e-3)
    assert moving[middle].all()
    assert not moving[-1]


def test_state_is_the_last_register_refresh():
    rig = make_rig()
    rig.until(101.9)
    first = rig.gripper.read()
    rig.until(104.9)
    assert rig.gripper.read().seq == first.seq
    assert first.t_ns == 100 * MS
    rig.until(105.1)
    assert rig.gripper.read().seq == first.seq + 1


def test_object_detection_stalls_at_the_force_limit():
    rig = make_rig()
    rig.until(100)
    rig.grip(0.0, force=20.0)
    rig.until(2500)
    state, truth = rig.gripper.read(), rig.cell.truth()
    assert state.contact is Contact.CLOSING
    assert not state.moving
    assert 0.012 < state.aperture_m < 0.025
    assert truth.normal_force_n == pytest.approx(20, abs=1.0)
    rig.until(3000)
    assert rig.gripper.read().aperture_m == state.aperture_m
    rig.grip(STRONG_M)
    rig.until(3500)
    assert rig.gripper.read().contact is Contact.NONE


def test_expired_and_mad_commands_are_refused():
    rig = make_rig()
    rig.until(100)
    with pytest.raises(CommandExpired):
        rig.gripper.command(GripperCommand(0.02, 0.05, 60, 100 * MS))
    for bad in (math.nan, math.inf):
        with pytest.raises(LimitExceeded):
            rig.gripper.command(GripperCommand(bad, 0.05, 60, FAR))
        with pytest.raises(LimitExceeded):
            rig.gripper.command(GripperCommand(0.02, 0.05, bad, FAR))
    rig.until(500)
    assert rig.cell.truth().aperture_m == 0.05


def test_stop_holds_and_cancels_what_is_under_way():
    rig = make_rig()
    rig.until(100)
    rig.grip(0.0215)
    rig.until(400)
    rig.grip(0.05)
    rig.until(420)
    held = rig.cell.truth().aperture_m
    rig.gripper.stop()
    rig.gripper.stop()
    rig.until(1500)
    assert rig.cell.truth().aperture_m == held


@pytest.mark.parametrize("advance_first", [True, False])
def test_stop_after_a_command_took_effect_does_not_undo_it(advance_first):
    rig = make_rig()
    rig.until(100)
    rig.grip(0.03)
    if advance_first:
        rig.until(300)
    else:
        rig.clock.sleep_until(300 * MS)
    rig.gripper.stop()
    rig.until(900)
    assert rig.cell.truth().aperture_m == pytest.approx(0.05 - 0.05008 * 0.16, abs=0.5e-3)


def test_closing_the_device_keeps_the_grip():
    rig = make_rig()
    rig.until(100)
    rig.grip(STRONG_M)
    rig.until(1000)
    before = rig.cell.truth().normal_force_n
    rig.gripper.close()
    rig.until(1500)
    assert before > 5
    assert rig.cell.truth().normal_force_n == pytest.approx(before, rel=1e-3)
    assert rig.gripper.lifecycle is Lifecycle.CLOSED


def test_commands_only_when_armed():
    rig = make_rig(ready=False)
    rig.gripper.connect()
    with pytest.raises(LifecycleError):
        rig.grip(0.03)
    rig.gripper.arm()
    rig.grip(0.03)
    rig.gripper.disarm()
    with pytest.raises(LifecycleError):
        rig.grip(0.03)


def test_activation_closes_and_opens_on_the_rigs_clock():
    rig = make_rig(gripper={"activated": False}, ready=False)
    rig.gripper.connect()
    rig.gripper.arm()
    assert rig.clock.now() == 1500 * MS
    rig.cell.advance(700 * MS)
    assert rig.cell.truth().aperture_m < 0.03
    rig.until(1500)
    assert rig.cell.truth().aperture_m == 0.05


def test_lost_commands_never_arrive():
    rig = make_rig(gripper={"command_loss": 1.0})
    rig.grip(0.03)
    rig.until(1000)
    assert rig.cell.truth().aperture_m == 0.05
