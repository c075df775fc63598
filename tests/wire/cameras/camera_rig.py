"""Helpers for camera tests: mocks served in this process, leak checks, pictures that carry the time."""

from __future__ import annotations

import contextlib
import gc
import os
import threading

import cv2
import numpy as np
from lsds_mocks.scene.lens import camera_model
from lsds_mocks.scene.stage import MARKERS, VIEWPOINT
from lsds_mocks.wire.cameras.gelsight_mini import build as build_gelsight
from lsds_mocks.wire.cameras.options import GelSightMiniOptions, TruthCameraOptions
from lsds_mocks.wire.cameras.truth_camera import TruthCamera
from lsds_mocks.wire.mjpeg.camera import CameraMock
from lsds_mocks.wire.mjpeg.options import CameraOptions

from lsds.calibration.vision.camera import save_camera
from lsds.calibration.vision.rotation import quaternion_of
from lsds.clock import WallClock, nanoseconds
from lsds.contracts import BuildContext
from lsds.errors import DataError, StaleData
from lsds.registry import PluginHost
from tests.wire.waiting import until

HOST = PluginHost()
CLOCK = WallClock()
BITS = 24
UNIT_NS = 100_000
"""Black and white bars that encode a time in tenths of a millisecond, repeating after half an hour."""
RATE_HZ = 25.0

cv2.setNumThreads(1)


@contextlib.contextmanager
def served(mock):
    """Run a wire mock in a thread; give its addresses."""
    stop = threading.Event()
    addresses = mock.start()
    thread = threading.Thread(target=mock.serve, args=(stop,), daemon=True)
    thread.start()
    try:
        yield addresses
    finally:
        stop.set()
        thread.join(5)
        mock.close()
        assert not thread.is_alive()


def gelsight(seed=0, **options):
    return build_gelsight(GelSightMiniOptions(**{"port": 0, **options}), BuildContext(CLOCK, seed))


def truth_camera(seed=0, **options):
    return TruthCamera(TruthCameraOptions(**{"port": 0, **options}), BuildContext(CLOCK, seed))


class TimePicture:
    """Shows when it was taken as black and white bars, so that any client can compute the age of a picture."""

    def __init__(self, width, height):
        rng = np.random.default_rng(0)
        self._back = rng.normal(128, 8, (height, width, 3)).clip(0, 255).astype(np.uint8)

    def picture(self, t_ns, seq, since_start):
        image = self._back.copy()
        step = image.shape[1] // BITS
        for bit in range(BITS):
            image[:40, bit * step : (bit + 1) * step] = 255 * (t_ns // UNIT_NS >> bit & 1)
        return image

    def close(self):
        pass


def time_camera(width=640, height=480, **options):
    options = CameraOptions(**{"port": 0, "rate_hz": RATE_HZ, **options})
    return CameraMock("time-camera", options, TimePicture(width, height), seed=0, clock=CLOCK)


def age_ms(image):
    """How old a picture with bars is."""
    step = image.shape[1] // BITS
    shown = sum(int(image[20, bit * step + step // 2, 1] > 128) << bit for bit in range(BITS))
    return (CLOCK.now() // UNIT_NS - shown) % (1 << BITS) * UNIT_NS / 1e6


def sensor(url, name="gelsight-mini", **options):
    return HOST.build("sensor", name, {"camera": url, **options}, BuildContext(CLOCK, 0))


def markers():
    return [{"id": number, "body": body, "size_mm": size} for body, (number, size) in MARKERS.items()]


def aruco(url, calibration, **options):
    table = {
        "camera": url,
        "calibration": str(calibration),
        "markers": markers(),
        "camera_position_m": VIEWPOINT.position_m.tolist(),
        "camera_quaternion_xyzw": list(quaternion_of(VIEWPOINT.rotation)),
    }
    return HOST.build("pose_source", "aruco", {**table, **options}, BuildContext(CLOCK, 0))


def calibration(folder, width=640, height=480):
    path = folder / f"camera_{width}.yaml"
    save_camera(path, camera_model(width, height))
    return path


@contextlib.contextmanager
def nothing_left():
    """Assert that no thread and no descriptor is left behind. Those of a mock served in this process count, too."""
    threads, descriptors = set(threading.enumerate()), open_descriptors()
    yield
    assert until(lambda: set(threading.enumerate()) <= threads, 3.0), threading.enumerate()
    assert until(lambda: len(open_descriptors()) <= len(descriptors), 3.0), (descriptors, open_descriptors())


def open_descriptors():
    gc.collect()
    found = []
    for name in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):
            found.append(os.readlink(f"/proc/self/fd/{name}"))
    return sorted(found)


def wait(seconds):
    CLOCK.sleep_until(CLOCK.now() + nanoseconds(seconds))


def outcomes(device, duration_s):
    """Read for a while; return fresh samples and what was raised, by class. Anything but those named goes through."""
    samples, raised = {}, []
    deadline = CLOCK.now() + nanoseconds(duration_s)
    while CLOCK.now() < deadline:
        try:
            sample = device.read()
            samples[sample.seq] = sample
        except (StaleData, DataError) as error:
            if not raised or type(raised[-1]) is not type(error) or str(raised[-1]) != str(error):
                raised.append(error)
        wait(0.004)
    return list(samples.values()), raised
