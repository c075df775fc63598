"""Checks of the samples of sensors and pose sources."""

from __future__ import annotations

import math

import numpy as np

from lsds.testing.bench import Bench


def check_frames_are_as_declared(bench: Bench) -> None:
    """Frames are uint8 RGB of the declared size, with times and numbers that only go up together."""
    with bench.device() as device:
        spec = device.spec
        assert spec.width_px > 0
        assert spec.height_px > 0
        assert spec.rate_hz > 0
        assert spec.metres_per_px > 0
        last = None
        for frame in bench.samples(device, 0.5):
            assert frame.image.dtype == np.uint8
            assert frame.image.shape == (spec.height_px, spec.width_px, 3)
            assert frame.t_ns <= bench.clock.now(), "a frame from the future"
            if last is not None:
                assert frame.seq >= last.seq, "a sequence number went back"
                assert (frame.seq > last.seq) == (frame.t_ns > last.t_ns), "number and time must go up together"
            last = frame


def check_frame_rate(bench: Bench) -> None:
    """New frames arrive at the declared rate within 20 %, or until a recording ends."""
    with bench.device() as device:
        stamps = {frame.seq: frame.t_ns for frame in bench.samples(device, 1.0, 0.2 / device.spec.rate_hz)}
        assert len(stamps) >= 2, "no second frame came in 1 s"
        first, last = min(stamps), max(stamps)
        rate = (last - first) / (stamps[last] - stamps[first]) * 1e9
        assert abs(rate / device.spec.rate_hz - 1) < 0.2, f"{rate:.1f} Hz measured, {device.spec.rate_hz} Hz declared"


def check_frames_are_not_overwritten(bench: Bench) -> None:
    """The image of a frame does not change when newer frames arrive."""
    with bench.device() as device:
        first = bench.read(device)
        copy = first.image.copy()
        for _ in bench.samples(device, 0.2):
            pass
        assert np.array_equal(first.image, copy), "the device changed a frame that it had returned before"


def check_same_seed_gives_same_frames(bench: Bench) -> None:
    """A simulated sensor gives bit-identical frames for the same seed."""
    if not bench.virtual:
        return
    runs = []
    for _ in range(2):
        with bench.device() as device:
            runs.append([(f.t_ns, f.seq, f.image.tobytes()) for f in bench.samples(device, 0.1, 0.02)])
    assert runs[0] == runs[1]


def check_poses(bench: Bench) -> None:
    """Poses are finite with unit quaternions, with times and numbers that only go up together."""
    with bench.device() as device:
        last = None
        for sample in bench.samples(device, 0.3):
            for body, pose in sample.poses.items():
                assert all(map(math.isfinite, pose.position_m)), body
                assert abs(math.hypot(*pose.quaternion_xyzw) - 1) < 1e-6, body
            if last is not None:
                assert (sample.seq > last.seq) == (sample.t_ns > last.t_ns)
                assert sample.seq >= last.seq
            last = sample


SENSOR_CHECKS = (
    check_frames_are_as_declared,
    check_frame_rate,
    check_frames_are_not_overwritten,
    check_same_seed_gives_same_frames,
)
POSE_CHECKS = (check_poses,)
