"""The driver on a fake camera: which device it opens, light and orientation, and one clear error for each failure."""

from __future__ import annotations

import re
import time

import cv2
import numpy as np
import pytest
from lsds.clock import WallClock
from lsds.contracts import BuildContext, Lifecycle
from lsds.errors import ConfigError, ConnectFailed, DeviceError, StaleData
from lsds.registry import PluginHost

from conftest import UPRIGHT_RED, Desk
from lsds_digit.sensor import DigitSensor


def error_of(sensor: DigitSensor, timeout_s: float = 3.0) -> DeviceError:
    """Return the first error of `read`."""
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        try:
            sensor.read()
        except DeviceError as error:
            return error
        time.sleep(0.01)
    raise AssertionError("no error")


# -- what it does ---------------------------------------------------------------------------------------------


def test_the_image_is_upright_and_rgb(desk: Desk) -> None:
    image = desk.connected().read().image
    assert image.shape == (320, 240, 3)
    red = image[UPRIGHT_RED].reshape(-1, 3).mean(0)
    assert red[0] > 200 > 50 > red[2]
    assert np.ptp(image[60:, 80:]) < 20


@pytest.mark.parametrize(("mode", "size", "rate_hz"), [("qvga", (240, 320), 60.0), ("vga", (480, 640), 30.0)])
def test_each_mode_has_its_size_rate_and_scale(desk: Desk, mode: str, size: tuple[int, int], rate_hz: float) -> None:
    sensor = desk.connected(mode=mode, field_mm=19.2)
    spec = sensor.spec
    assert (spec.width_px, spec.height_px) == size
    assert spec.rate_hz == rate_hz == desk.capture.set_to[cv2.CAP_PROP_FPS]
    assert spec.metres_per_px * spec.height_px == pytest.approx(0.0192)
    assert sensor.read().image.shape == (size[1], size[0], 3)


def test_a_gel_has_no_markers_unless_the_rig_declares_them(desk: Desk) -> None:
    assert desk.driver().spec.pad is None
    built = PluginHost().build("sensor", "digit", {"pad": [7, 5]}, BuildContext(WallClock()))
    assert built.spec.pad == (7, 5)


@pytest.mark.parametrize(("intensity", "value"), [(None, 0xFFF), (0, 0), (5, 0x555)])
def test_the_light_is_set_for_all_three_leds(desk: Desk, intensity: int | None, value: int) -> None:
    desk.connected(intensity=intensity)
    assert desk.capture.set_to[cv2.CAP_PROP_ZOOM] == value


def test_a_camera_without_that_control_works_if_no_light_is_asked_for(desk: Desk) -> None:
    desk.capture.has_leds = False
    desk.connected()
    with pytest.raises(ConnectFailed, match=r"does not set the LED intensity \(leave intensity out, or update"):
        desk.driver(intensity=15).connect()
    assert desk.capture.released == 1


def test_a_frame_has_the_time_of_the_kernel_if_that_is_plausible(desk: Desk) -> None:
    desk.capture.stamp_age_s = 0.1
    sensor = desk.connected()
    assert time.monotonic_ns() - sensor.read().t_ns > 90_000_000
    desk.capture.stamp_age_s = 1000.0
    time.sleep(0.1)
    assert time.monotonic_ns() - sensor.read().t_ns < 90_000_000


# -- which device ---------------------------------------------------------------------------------------------


def test_the_only_digit_is_opened_without_a_name(desk: Desk) -> None:
    desk.connected()
    assert desk.opened == [str(desk.folder / "usb-Facebook_DIGIT_D20790-video-index0")]


def test_one_of_several_is_chosen_by_its_serial_number(desk: Desk) -> None:
    desk.plug("Facebook_DIGIT_D20791")
    with pytest.raises(ConnectFailed, match=r"several DIGITs are connected \(set serial to one of D20790, D20791\)"):
        desk.driver().connect()
    desk.connected(serial="D20791")
    assert [path.rpartition("_")[2] for path in desk.opened] == ["D20791-video-index0"]


def test_a_serial_number_that_is_not_there_lists_those_that_are(desk: Desk) -> None:
    with pytest.raises(ConnectFailed, match=r"no DIGIT has the serial number D1 \(connected: D20790\)"):
        desk.driver(serial="D1").connect()


def test_without_any_digit_the_error_names_the_folder(desk: Desk) -> None:
    for entry in desk.folder.iterdir():
        entry.unlink()
    with pytest.raises(ConnectFailed, match=r"no DIGIT is connected \(plug it in; .* lists no DIGIT\)"):
        desk.driver().connect()


def test_an_index_names_the_device_file(desk: Desk) -> None:
    with pytest.raises(ConnectFailed, match=r"there is no /dev/video255 \(connected: D20790\)"):
        desk.driver(index=255).connect()


def test_serial_and_index_together_are_refused() -> None:
    with pytest.raises(ConfigError, match="serial and index both name the camera; leave one out"):
        PluginHost().build("sensor", "digit", {"serial": "D1", "index": 0}, BuildContext(WallClock()))


# -- what fails -----------------------------------------------------------------------------------------------


def test_a_camera_that_another_program_holds_is_named(desk: Desk) -> None:
    desk.capture.opens = False
    sensor = desk.driver()
    with pytest.raises(ConnectFailed, match=r"D20790-video-index0 does not open \(end the program that uses it"):
        sensor.connect()
    assert sensor.lifecycle is Lifecycle.NEW
    desk.capture.opens = True
    sensor.connect()


def test_another_camera_is_found_by_its_size(desk: Desk) -> None:
    desk.capture.size = (1280, 720)
    with pytest.raises(ConnectFailed, match=r"sends 1280 x 720 px \(qvga has 320 x 240; check that it is a DIGIT\)"):
        desk.driver().connect()


def test_a_camera_that_hangs_ends_connect_in_time(desk: Desk) -> None:
    desk.capture.hangs = True
    with pytest.raises(ConnectFailed, match=r"no frame came within 0\.2 s \(unplug the sensor"):
        desk.driver(connect_timeout_s=0.2).connect()


@pytest.mark.parametrize(("fault", "words"), [("unplugged", "sends no frames"), ("raises", "OpenCV failed: .*gone")])
def test_a_lost_camera_is_stale_with_its_cause_and_comes_back(desk: Desk, fault: str, words: str) -> None:
    sensor = desk.connected(stale_after_ms=200.0)
    last = sensor.read().seq
    setattr(desk.capture, fault, True)
    error = error_of(sensor)
    assert isinstance(error, StaleData)
    assert re.search(words, str(error))
    assert "check the cable" in str(error)
    setattr(desk.capture, fault, False)
    deadline = time.monotonic() + 3.0
    while True:
        try:
            assert sensor.read().seq > last
            break
        except StaleData:
            assert time.monotonic() < deadline, "the camera did not come back"
            time.sleep(0.01)
