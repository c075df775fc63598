"""The camera on the simulated fingertip, without LeRobot and without hardware."""

from __future__ import annotations

import importlib.metadata
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lsds.errors import ConfigError, DataError, DeviceFault, StaleData

from lerobot.cameras.configs import CameraConfig
from lerobot_camera_lsds import LsdsCamera, LsdsCameraConfig
from lerobot_camera_lsds.capture import Capture

FAST = ["cell.simulated.fidelity=winkler"]


def config(**given: Any) -> LsdsCameraConfig:
    return LsdsCameraConfig(**{"overrides": FAST, **given})


@pytest.fixture
def camera() -> Iterator[LsdsCamera]:
    camera = LsdsCamera(config())
    camera.connect()
    yield camera
    if camera.is_connected:
        camera.disconnect()


def test_lerobot_finds_distribution_config_and_class_by_their_names() -> None:
    assert importlib.metadata.distribution("lerobot_camera_lsds").metadata["Name"] == "lerobot_camera_lsds"
    assert CameraConfig.get_choice_class("lsds") is LsdsCameraConfig
    assert config().type == "lsds"
    # LeRobot looks for the class in the package that holds the module of its config.
    assert LsdsCameraConfig.__name__.removesuffix("Config") == LsdsCamera.__name__
    assert LsdsCameraConfig.__module__.rpartition(".")[0] == "lerobot_camera_lsds"


def test_frames_are_rgb_images_that_change(camera: LsdsCamera) -> None:
    assert (camera.width, camera.height, camera.fps) == (320, 240, 25)
    first, second = camera.read(), camera.read()
    assert first.shape == (240, 320, 3)
    assert first.dtype == np.uint8
    assert not np.array_equal(first, second)
    assert camera.read_latest().shape == (240, 320, 3)


def test_async_read_never_returns_one_frame_twice(camera: LsdsCamera) -> None:
    frames = [camera.async_read(timeout_ms=2000) for _ in range(3)]
    assert len({id(frame) for frame in frames}) == 3
    with pytest.raises(TimeoutError, match="no new frame within 0 ms"):
        camera.async_read(timeout_ms=0)


def test_it_is_connected_between_connect_and_disconnect() -> None:
    camera = LsdsCamera(config())
    assert not camera.is_connected
    for call in (camera.read, camera.async_read, camera.read_latest, camera.disconnect):
        with pytest.raises(ConnectionError, match=r"not connected; call connect\(\)"):
            call()
    with camera:
        assert camera.is_connected
        with pytest.raises(ConnectionError, match="already connected"):
            camera.connect()
    assert not camera.is_connected
    assert not [thread for thread in threading.enumerate() if thread.name == "lsds-camera"]
    with camera:
        assert camera.read().shape == (240, 320, 3)


def test_a_rig_file_names_the_finger(tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    left = '[sensors.left]\nbackend = "mock-gelsight-mini"\n'
    right = '[sensors.right]\nbackend = "mock-gelsight-mini"\n[sensors.right.mock-gelsight-mini]\nfinger = "right"\n'
    rig.write_text(left + right)
    with LsdsCamera(config(rig=str(rig), finger="right")) as camera:
        assert camera.read().shape == (240, 320, 3)
    with pytest.raises(ConfigError, match=r"no finger 'thumb' \(one of: left, right\)"):
        LsdsCamera(config(rig=str(rig), finger="thumb")).connect()
    with pytest.raises(ConfigError, match="write them as overrides"):
        LsdsCamera(config(rig=str(rig), options=["finger=left"])).connect()


def test_options_are_those_of_the_sensor() -> None:
    with LsdsCamera(config(options=["finger=right"])) as camera:
        assert camera.read().shape == (240, 320, 3)
    with pytest.raises(ConfigError, match="nonsense"):
        LsdsCamera(config(options=["nonsense=1"])).connect()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"width": 640}, "width is 640, the sensor delivers 320; set width to 320"),
        ({"height": 480}, "height is 480, the sensor delivers 240"),
        ({"fps": 60}, "fps is 60, the sensor delivers 25"),
    ],
)
def test_a_size_or_rate_that_the_sensor_does_not_have_is_refused(given: dict[str, int], words: str) -> None:
    camera = LsdsCamera(config(**given))
    with pytest.raises(ValueError, match=words):
        camera.connect()
    assert not camera.is_connected


def test_another_colour_mode_is_refused(camera: LsdsCamera) -> None:
    assert camera.read("rgb").shape == (240, 320, 3)
    with pytest.raises(ValueError, match="colour mode 'bgr' is not supported; use 'rgb'"):
        camera.read("bgr")


def test_a_camera_connects_no_gripper_and_no_arm() -> None:
    camera = LsdsCamera(config())
    camera.connect()
    rig = camera._tip._rig  # type: ignore[union-attr]
    assert rig.gripper is None
    assert rig.arm is None
    camera.disconnect()


def test_find_cameras_lists_sensor_backends() -> None:
    assert "mock-gelsight-mini" in [found["id"] for found in LsdsCamera.find_cameras()]


def test_a_missing_frame_is_waited_out_and_named(camera: LsdsCamera, monkeypatch: pytest.MonkeyPatch) -> None:
    tip = camera._tip
    assert tip is not None
    real = tip.read

    def missing() -> Any:
        raise StaleData("gel", "no frame for 1 s", remedy="check the cable")

    monkeypatch.setattr(tip, "read", missing)
    time.sleep(0.2)
    with pytest.raises(TimeoutError, match=r"within 100 ms \(gel: no frame for 1 s \(check the cable\)\)"):
        camera._open().next(0.1, after_now=True)
    with pytest.raises(TimeoutError, match="ms old, the limit is 10 ms"):
        camera.read_latest(max_age_ms=10)
    monkeypatch.setattr(tip, "read", real)
    assert camera.read().shape == (240, 320, 3)


@pytest.mark.parametrize("error", [DeviceFault("gel", "unplugged"), EOFError("end of the recording")])
def test_a_lost_sensor_is_raised_at_every_call(
    camera: LsdsCamera, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    def lost() -> Any:
        raise error

    monkeypatch.setattr(camera._tip, "read", lost)
    time.sleep(0.2)
    for call in (camera.read, camera.async_read, camera.read_latest):
        with pytest.raises(type(error), match=str(error)):
            call()
    camera.disconnect()


def test_a_damaged_frame_is_skipped(camera: LsdsCamera, monkeypatch: pytest.MonkeyPatch) -> None:
    tip = camera._tip
    assert tip is not None
    real, calls = tip.read, iter(range(100))

    def sometimes() -> Any:
        if next(calls) < 2:
            raise DataError("frame 7 is damaged")
        return real()

    monkeypatch.setattr(tip, "read", sometimes)
    assert camera.read().shape == (240, 320, 3)


def test_no_frame_before_the_first_is_no_frame() -> None:
    with pytest.raises(RuntimeError, match=r"no frame has arrived yet; call read\(\)"):
        Capture(None).latest(1.0)  # type: ignore[arg-type]
