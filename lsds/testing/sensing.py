"""Checks of the frames of sensors."""

from __future__ import annotations

import numpy as np

from lsds.contracts.values import Frame
from lsds.testing.bench import Bench
from lsds.testing.outcomes import NotApplicable

_BUFFERS = 40
"""Number of frames after which a frame must still be the same; chosen above the buffers of camera drivers."""


def check_frames_are_as_declared(bench: Bench) -> None:
    """Frames are uint8 RGB of the declared size, and a frame that is returned again is the same."""
    with bench.device() as device:
        shape = (device.spec.height_px, device.spec.width_px, 3)
        last = None
        for frame in bench.samples(device, 0.5):
            assert isinstance(frame, Frame), f"read() returned {type(frame).__name__}; return a Frame"
            image = frame.image
            assert isinstance(image, np.ndarray), f"the image is {type(image).__name__}; return a NumPy array"
            assert image.dtype == np.uint8, f"the image is {image.dtype}, not uint8; convert it to 8 bits"
            assert image.shape == shape, f"the image is {image.shape}, and the spec declares {shape} (height, width, 3)"
            if last is not None and frame.seq == last.seq:
                same = np.array_equal(image, last.image)
                assert same, f"frame {frame.seq} came again with another image; give each image its own seq"
            last = frame


def check_frame_rate(bench: Bench) -> None:
    """New frames arrive at the declared rate within 20 %, or until a recording ends."""
    with bench.device() as device:
        stamps = {frame.seq: frame.t_ns for frame in bench.samples(device, 1.0, 0.2 / device.spec.rate_hz)}
        assert len(stamps) >= 2, f"no second frame came in 1 s, and {device.spec.rate_hz} Hz are declared"
        first, last = min(stamps), max(stamps)
        span_s = (stamps[last] - stamps[first]) * 1e-9
        assert span_s > 0, f"frames {first} and {last} have the same time; stamp each with its exposure"
        rate = (last - first) / span_s
        assert abs(rate / device.spec.rate_hz - 1) < 0.2, (
            f"seq and t_ns give {rate:.1f} Hz, and {device.spec.rate_hz} Hz are declared; count every frame once, and "
            "declare the rate that the camera has"
        )


def check_frames_are_not_overwritten(bench: Bench) -> None:
    """The image of a frame does not change when newer frames arrive."""
    with bench.device() as device:
        first = bench.read(device)
        copy = first.image.copy()
        # Cameras reuse a few buffers in turn.
        for _ in bench.samples(device, _BUFFERS / device.spec.rate_hz, 0.5 / device.spec.rate_hz):
            pass
        assert np.array_equal(first.image, copy), (
            f"the device changed a frame that it had returned before (seq {first.seq}); return a new array every time"
        )


def check_same_seed_gives_same_frames(bench: Bench) -> None:
    """A simulated sensor gives bit-identical frames for the same seed."""
    if not bench.virtual:
        raise NotApplicable("the sensor is not simulated")
    runs = []
    for _ in range(2):
        with bench.device() as device:
            runs.append([(f.t_ns, f.seq, f.image.tobytes()) for f in bench.samples(device, 0.1, 0.02)])
    differing = [one[1] for one, other in zip(*runs, strict=False) if one != other]
    same = runs[0] == runs[1]  # compared outside of the assertion: pytest would look for the differences of all pixels
    assert same, (
        f"two builds with the same seed give other frames (first at seq {next(iter(differing), 'the end')}); "
        "take random numbers from numpy.random.default_rng(context.rng_seed(...))"
    )


SENSOR_CHECKS = (
    check_frames_are_as_declared,
    check_frame_rate,
    check_frames_are_not_overwritten,
    check_same_seed_gives_same_frames,
)
