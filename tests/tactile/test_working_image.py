"""Perception does not depend on the size of the camera's image, nor on the order of its colours."""

from __future__ import annotations

from itertools import permutations

import cv2
import numpy as np
import pytest

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext, Frame, SensorSpec
from lsds.registry import PluginHost
from lsds.tactile.options import TactileOptions
from lsds.tactile.perception import Perception
from lsds.tactile.working_image import WorkingImage, lamp_order, lamps_are_turned
from lsds.testing import Bench

FRAMES = 3


@pytest.fixture(scope="module")
def recorded() -> tuple[list[Frame], SensorSpec]:
    """Frames of the simulated gel."""
    bench = Bench("sensor", "mock-gelsight-mini")
    with bench.device() as sensor:
        frames = {frame.seq: frame for frame in bench.samples(sensor, 0.3)}
        return list(frames.values())[:FRAMES], sensor.spec


def seen(frames: list[Frame], spec: SensorSpec) -> tuple[Perception, list[np.ndarray]]:
    """Markers' positions in m of each frame after the reference."""
    tracker = PluginHost().build("tracker", "lk", {}, BuildContext(VirtualClock(), 0))
    perception = Perception(tracker, spec, TactileOptions())
    perception.start(frames[:1])
    return perception, [perception.observe(frame)[0].field.displacement_m for frame in frames[1:]]


def changed(frames: list[Frame], change) -> list[Frame]:
    return [Frame(np.ascontiguousarray(change(frame.image)), frame.t_ns, frame.seq) for frame in frames]


@pytest.mark.parametrize("times", [2, 3])
def test_a_larger_image_is_the_same_gel(recorded, times):
    frames, spec = recorded
    height, width = frames[0].image.shape[:2]
    larger = changed(frames, lambda image: cv2.resize(image, None, fx=times, fy=times, interpolation=cv2.INTER_NEAREST))
    large = SensorSpec(width * times, height * times, spec.rate_hz, spec.metres_per_px / times, spec.pad)
    perception, moved = seen(larger, large)
    own, expected = seen(frames, spec)
    assert perception.metres_per_px == pytest.approx(own.metres_per_px)
    assert perception.reference is not None
    assert own.reference is not None
    np.testing.assert_array_equal(perception.reference.xy_px, own.reference.xy_px)
    for a, b in zip(moved, expected, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-9)


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_the_order_of_the_colours_is_measured(recorded, order):
    frames, _ = recorded
    stranger = changed(frames, lambda image: image[..., order])
    working = WorkingImage(stranger[0])
    for frame, own in zip(stranger, frames, strict=True):
        np.testing.assert_array_equal(working.frame(frame).image, own.image)


def test_a_small_image_is_enlarged(recorded):
    frames, _ = recorded
    small = changed(frames, lambda image: cv2.resize(image, (160, 120), interpolation=cv2.INTER_AREA))
    working = WorkingImage(small[0])
    assert working.frame(small[0]).image.shape == (240, 320, 3)
    assert working.scale == 0.5


def test_an_image_of_the_usual_kind_is_not_copied(recorded):
    frames, _ = recorded
    assert WorkingImage(frames[0]).frame(frames[1]) is frames[1]


def test_light_without_a_direction_keeps_the_order():
    assert lamp_order(np.full((240, 320, 3), 120, np.uint8)) == (0, 1, 2)


@pytest.mark.parametrize("order", list(permutations(range(3))))
@pytest.mark.parametrize("quarters", range(4))
def test_light_from_other_sides_is_noticed_whatever_the_order_of_the_colours(recorded, quarters, order):
    frames, _ = recorded
    turned = np.ascontiguousarray(np.rot90(frames[0].image[..., order], quarters))
    assert lamps_are_turned(turned) == (quarters % 2 == 1)


def test_light_without_a_direction_is_not_turned():
    assert not lamps_are_turned(np.full((240, 320, 3), 120, np.uint8))


def test_a_frame_keeps_its_time_number_and_mark(recorded):
    frames, _ = recorded
    swapped = Frame(np.ascontiguousarray(frames[0].image[..., ::-1]), 7, 3, True)
    frame = WorkingImage(swapped).frame(swapped)
    assert (frame.t_ns, frame.seq, frame.redrawn) == (7, 3, True)
