"""Measure the cameras: `python -m tests.wire.cameras.bench [--json FILE]`, from the repository's root.

Rate and latency of the GelSight's wire face read by OpenCV (from the exposure, before rendering, to decoded pixels),
the same through our driver, poses over the wire, and the error of the slip speed against its smoothing.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
from lsds_mocks.mock_process import MockProcess

from lsds.clock import WallClock
from lsds.errors import DataError, StaleData
from tests.wire.cameras.camera_rig import BITS, UNIT_NS, age_ms, aruco, calibration, sensor, served
from tests.wire.cameras.motion_scenes import slip_speeds, steady, swinging

SIZES = ((320, 240), (640, 480), (1640, 1232), (3280, 2464))
READS = 150
CLOCK = WallClock()


class DatedGel:
    """The gel's picture with its time in bars along the upper edge."""

    def __init__(self, width, height):
        from lsds_mocks.wire.cameras.gelsight_mini import GelView
        from lsds_mocks.wire.cameras.links import gel_link
        from lsds_mocks.wire.cameras.options import GelSightMiniOptions

        from lsds.contracts import BuildContext

        options = GelSightMiniOptions(width=width, height=height, scene="rest")
        self._view = GelView(options, gel_link(options, CLOCK, 0), BuildContext(CLOCK, 0))

    def picture(self, t_ns, seq, since_start):
        image = self._view.picture(t_ns, seq, since_start)
        step = image.shape[1] // BITS
        for bit in range(BITS):
            image[:40, bit * step : (bit + 1) * step] = 255 * (t_ns // UNIT_NS >> bit & 1)
        return image

    def close(self):
        self._view.close()


def serve(width, height, addresses, end):
    """The other process: a camera that dates its pictures."""
    from lsds_mocks.wire.mjpeg.camera import CameraMock
    from lsds_mocks.wire.mjpeg.options import CameraOptions

    mock = CameraMock("bench", CameraOptions(port=0), DatedGel(width, height), seed=0, clock=CLOCK)
    with served(mock) as found:
        addresses.put(found["http"])
        end.wait()


def through_opencv(width, height):
    """Rate and latency seen by cv2.VideoCapture in this process, of a camera in another."""
    spawn = multiprocessing.get_context("spawn")
    addresses, end = spawn.Queue(), spawn.Event()
    process = spawn.Process(target=serve, args=(width, height, addresses, end))
    process.start()
    capture = cv2.VideoCapture(addresses.get(timeout=30))
    ages, times = [], []
    for _ in range(READS):
        _, image = capture.read()
        ages.append(age_ms(image))
        times.append(CLOCK.now())
    capture.release()
    end.set()
    process.join(10)
    settled = len(times) // 5
    rate = (len(times) - 1 - settled) / ((times[-1] - times[settled]) / 1e9)
    return {"fps": rate, **spread(ages[settled:])}


def through_driver(width, height):
    """Rate and age of frames as `lsds` reads them: 320 x 240 for any camera size."""
    with MockProcess("gelsight-mini", {"port": 0, "width": width, "height": height, "scene": "slide"}) as mock:
        camera = sensor(mock.addresses["http"], border=0.0 if width == 320 else 0.15)
        camera.connect()
        ages = fresh_ages(camera, 6.0)
        rate = camera.measured_rate_hz
        camera.close()
    return {"fps": rate, **spread(ages)}


def poses_over_the_wire():
    """Rate and age of poses from the ground-truth camera at 60 Hz, 640 x 480."""
    with MockProcess("truth-camera", {"port": 0}) as mock, tempfile.TemporaryDirectory() as folder:
        source = aruco(mock.addresses["http"], calibration(Path(folder)))
        source.connect()
        ages = fresh_ages(source, 6.0)
        rate = source.measured_rate_hz
        source.close()
    return {"fps": rate, **spread(ages)}


def fresh_ages(device, duration_s):
    ages, last, end = [], -1, CLOCK.now() + round(duration_s * 1e9)
    while CLOCK.now() < end:
        try:
            sample = device.read()
        except (StaleData, DataError):
            continue
        finally:
            CLOCK.sleep_until(CLOCK.now() + 300_000)
        if sample.seq != last:
            last = sample.seq
            ages.append((CLOCK.now() - sample.t_ns) / 1e6)
    return ages


def spread(ages):
    return {f"p{p}_ms": float(np.percentile(ages, p)) for p in (50, 95)} | {"max_ms": float(np.max(ages))}


def measure():
    result = {"opencv": {}, "driver": {}}
    for width, height in SIZES:
        result["opencv"][f"{width}x{height}"] = through_opencv(width, height)
        result["driver"][f"{width}x{height}"] = through_driver(width, height)
    result["poses"] = poses_over_the_wire()
    result["slip_speed"] = {
        motion.__name__: {
            f"{tau * 1e3:.0f} ms": {
                "rms_cm_s": 100 * found.rms_m_s,
                "rms_without_lag_cm_s": 100 * found.rms_without_lag_m_s,
                "lag_ms": 1e3 * found.lag_s,
            }
            for tau in (0.0, 0.02, 0.03, 0.05, 0.1)
            for found in [slip_speeds(tau, motion)]
        }
        for motion in (steady, swinging)
    }
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", metavar="FILE", help="write the figures to FILE")
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    result = measure()
    for client in ("opencv", "driver"):
        for size, row in result[client].items():
            print(f"{client:7} {size:10}", "  ".join(f"{key} {value:.1f}" for key, value in row.items()))
    print("poses   640x480   ", "  ".join(f"{key} {value:.1f}" for key, value in result["poses"].items()))
    for motion, rows in result["slip_speed"].items():
        for tau, row in rows.items():
            print(f"{motion:9} {tau:7}", "  ".join(f"{key} {value:.3f}" for key, value in row.items()))
    if arguments.json:
        Path(arguments.json).write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
