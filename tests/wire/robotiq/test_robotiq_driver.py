"""The drivers' refusals, options, figures and arming."""

from __future__ import annotations

import errno
import os
import subprocess
import sys

import pytest
import serial
from lsds_drivers.robotiq.fault_codes import FAULTS, blocks
from lsds_drivers.robotiq.figures import HAND_E, TWO_FINGER
from lsds_drivers.robotiq.options import HandEOptions, TwoFingerOptions, UrcapOptions
from lsds_drivers.robotiq.registers import Status
from pydantic import ValidationError

from lsds.contracts import Contact, GripperCommand
from lsds.errors import ConnectFailed, DeviceFault
from tests.wire.robotiq.rig import CLOCK, HOST, build, nothing_left, options_for, serving, to
from tests.wire.waiting import until


def refusal(driver, **options):
    began = CLOCK.now()
    with nothing_left():
        gripper = build(driver, options)
        with pytest.raises(ConnectFailed) as raised:
            gripper.connect()
        gripper.close()
    assert CLOCK.now() - began < 3e9
    return str(raised.value)


def test_a_port_that_is_not_there():
    assert "lsds devices" in refusal("hand-e", port="/dev/ttyUSB97")


def test_a_file_that_is_no_port(tmp_path):
    (tmp_path / "file").write_text("")
    assert "not a serial port" in refusal("hand-e", port=str(tmp_path / "file"))


def test_a_port_that_is_not_ours(monkeypatch):
    def refused(*_arguments, **_keywords):
        raise serial.SerialException(errno.EACCES, "Permission denied")

    monkeypatch.setattr(serial, "Serial", refused)
    assert "usermod -aG" in refusal("hand-e", port=os.devnull)


def test_a_port_in_use(tmp_path):
    with serving(tmp_path) as mock:
        with serial.Serial(mock.addresses["pty"], 115200, exclusive=True):
            assert "in use" in refusal("hand-e", port=mock.addresses["pty"])
        assert "one client" in refusal_while_another_has_it(mock)


def refusal_while_another_has_it(mock):
    first = build("hand-e", {"port": mock.addresses["tcp"]})
    first.connect()
    try:
        return refusal("hand-e", port=mock.addresses["tcp"], connect_timeout_s=0.3)
    finally:
        first.close()


def test_no_server_listens():
    assert "URCap" in refusal("hand-e", port="tcp://127.0.0.1:9")
    assert "URCap" in refusal("hand-e-urcap", host="127.0.0.1", port=9)


def test_another_slave(tmp_path):
    with serving(tmp_path) as mock:
        text = refusal("hand-e", port=mock.addresses["pty"], slave=8, connect_timeout_s=0.3)
    assert "slave 8" in text


@pytest.mark.parametrize("port", ["", "tcp://", "tcp://host", "udp://host:1", "socket://host:99999"])
def test_ports_that_cannot_be_meant(port):
    with pytest.raises(ValidationError):
        HandEOptions(port=port)


def test_figures_are_the_models_unless_they_are_given():
    assert HandEOptions(port="x").figures() == HAND_E
    assert TwoFingerOptions(port="x", model=140).figures() == TWO_FINGER[140]
    figures = UrcapOptions(host="x", stroke_mm=48.0, strongest_n=130.0, closed_count=230).figures()
    assert (figures.stroke_m, figures.force_n, figures.closed_count) == (0.048, (20.0, 130.0), 230)
    with pytest.raises(ValidationError):
        HandEOptions(port="x", slowest_mm_s=200.0)
    with pytest.raises(ValidationError):
        HandEOptions(port="x", open_count=230)


@pytest.mark.parametrize("figures", [HAND_E, *TWO_FINGER.values()])
def test_counts_and_back(figures):
    for share in (-0.5, 0.0, 0.31, 0.5, 1.0, 7.0):
        command = GripperCommand(share * figures.stroke_m, share * 0.2, share * 200, 0)
        motion = figures.motion(command)
        wanted = min(max(command.aperture_m, 0.0), figures.stroke_m)
        assert abs(figures.aperture_m(motion.position) - wanted) <= figures.resolution_m / 2 + 1e-12
        for value, count, span, back in (
            (command.speed_m_s, motion.speed, figures.speed_m_s, figures.speed_of),
            (command.force_n, motion.force, figures.force_n, figures.force_of),
        ):
            assert abs(back(count) - min(max(value, span[0]), span[1])) <= (span[1] - span[0]) / 510 + 1e-12


def test_the_manuals_status_frames():
    grip = Status.from_registers([0xB900, 0x00FF, 0xBD00])
    assert (grip.activated, grip.going, grip.activation, grip.detection) == (True, True, 3, 2)
    assert (grip.echo, grip.position, grip.current) == (255, 189, 0)
    assert Status.from_registers([0x3900, 0x00FF, 0x0E0A]).current == 10
    assert Status.from_registers([0x3100, 0x2B00, 0]).controller_fault == 2


def test_every_fault_code_of_the_manual_has_words_and_a_remedy():
    assert set(FAULTS) == {0x5, 0x7, 0x8, 0x9, 0xA, 0xB, 0xC, 0xD, 0xE, 0xF}
    assert all(fault.problem and fault.remedy for fault in FAULTS.values())
    assert [code for code in range(16) if not blocks(code)] == [0, 5, 9]


def test_what_the_vendors_libraries_are_needed_for_is_imported_when_it_is_used():
    code = (
        "import sys, lsds_drivers.manifest as m; m.lsds_backends(); import lsds_drivers.robotiq.backends;"
        "print([n for n in ('pymodbus', 'serial', 'numpy') if n in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
    for name in ("hand-e", "robotiq-2f"):
        spec = HOST.find("gripper", name).spec
        assert (spec.requires, spec.extra, spec.hardware_verified) == (("pymodbus", "serial"), "robotiq", "")


@pytest.mark.parametrize("driver", ["hand-e", "hand-e-urcap"])
def test_arming_activates_once_and_calibrates_on_request(tmp_path, driver):
    with nothing_left(), serving(tmp_path, activation_s=0.4, open_tick=9, closed_tick=233) as mock:
        options = options_for(driver, mock)
        gripper = build(driver, options | {"calibrate": True, "fastest_mm_s": 150.0})
        gripper.connect()
        before = gripper.spec.resolution_m
        gripper.arm()
        assert gripper.spec.resolution_m == pytest.approx(0.05 / (233 - 9))
        assert gripper.spec.resolution_m != before
        assert gripper.read().aperture_m == pytest.approx(0.05)
        sent = gripper.command(to(0.0, within_s=5))
        assert sent.aperture_m == 0
        assert until(lambda: gripper.read().aperture_m == 0)
        gripper.disarm()
        gripper.arm()
        gripper.close()

        again = build(driver, options)
        again.connect()
        again.arm()
        # It was active already. Counted from what the options say, not from what another driver has measured.
        assert again.read().aperture_m == 0
        again.close()


def test_calibrating_on_an_object_is_refused(tmp_path):
    with serving(tmp_path, activated=True, object_mm=20) as mock:
        gripper = build("hand-e", options_for("hand-e", mock) | {"calibrate": True})
        gripper.connect()
        with pytest.raises(DeviceFault, match="remove any object"):
            gripper.arm()
        gripper.close()


@pytest.mark.parametrize("driver", ["hand-e", "hand-e-urcap"])
def test_contact_is_reported(tmp_path, driver):
    with serving(tmp_path, activated=True, object_mm=20) as mock:
        gripper = build(driver, options_for(driver, mock))
        gripper.connect()
        gripper.arm()
        gripper.command(to(0.0, force_n=20.0, within_s=5))
        assert until(lambda: gripper.read().contact is Contact.CLOSING)
        state = gripper.read()
        assert not state.moving
        assert state.target_m == 0
        assert 0.018 < state.aperture_m < 0.02
        gripper.stop()
        assert until(lambda: gripper.read().contact is Contact.NONE)
        assert gripper.read().aperture_m == pytest.approx(state.aperture_m, abs=3e-4)
        gripper.close()


def test_before_it_is_armed_it_may_be_not_activated(tmp_path):
    with serving(tmp_path) as mock:
        mock.inject("gripper-fault", code=7)
        gripper = build("hand-e", options_for("hand-e", mock))
        gripper.connect()
        for _ in range(20):
            assert gripper.read().aperture_m == pytest.approx(0.05)
            CLOCK.sleep_until(CLOCK.now() + 10_000_000)
        gripper.close()


@pytest.mark.parametrize(("driver", "opening"), [("hand-e", True), ("hand-e-urcap", False)])
def test_automatic_release(tmp_path, driver, opening):
    with serving(tmp_path, activated=True, activation_s=0.2, aperture_mm=25) as mock:
        gripper = build(driver, options_for(driver, mock))
        gripper.connect()
        gripper.arm()
        gripper.automatic_release(opening=opening)

        def ended():
            try:
                gripper.read()
            except DeviceFault as fault:
                return fault.code == "0x0F"
            return False

        assert until(ended)
        gripper.disarm()
        gripper.arm()
        assert gripper.read().aperture_m == pytest.approx(0.05)
        gripper.close()


@pytest.mark.parametrize(("name", "model", "stroke"), [("robotiq-2f-85", 85, 0.085), ("robotiq-2f-140", 140, 0.140)])
def test_the_two_finger_grippers(tmp_path, name, model, stroke):
    with serving(tmp_path, name, activated=True) as mock:
        gripper = build("robotiq-2f", options_for("robotiq-2f", mock) | {"model": model})
        gripper.connect()
        gripper.arm()
        assert gripper.spec.stroke_m == stroke
        assert gripper.read().aperture_m == pytest.approx(stroke)
        began = CLOCK.now()
        gripper.command(GripperCommand(0.0, 1.0, 20.0, began + 10**9))
        assert until(lambda: gripper.read().aperture_m == 0)
        seconds = (CLOCK.now() - began) * 1e-9
        assert seconds > 0.9 * stroke / gripper.spec.speed_m_s[1]
        gripper.close()
