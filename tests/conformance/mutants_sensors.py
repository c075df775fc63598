"""Sensors and pose sources with a mistake in their samples or in their spec."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
from catching import caught_device
from honest_devices import HonestGripper, HonestPoses, HonestSensor, small

from lsds.contracts import Frame, Pose
from lsds.testing import arm_state, gel, pictures, sensing, specs, stamps

TOGETHER = stamps.check_number_and_time_go_up_together
FOLLOWS = stamps.check_time_follows_the_clock
SPEC = specs.check_spec_is_sound
FRAMES = sensing.check_frames_are_as_declared


def changed(device, **values):
    """Return the honest sample with other values."""
    sample = super(type(device), device).read()
    found = {name: value(getattr(sample, name)) for name, value in values.items()}
    if isinstance(sample, Frame):
        return Frame(sample.image, found.get("t_ns", sample.t_ns), found.get("seq", sample.seq))
    return replace(sample, **found)


@caught_device("sensor", stamps.check_new_samples_come, "seq was 0 in all samples")
class ConstantNumber(HonestSensor):
    def read(self):
        return changed(self, seq=lambda seq: 0)


@caught_device("gripper", FOLLOWS, r"samples are 0\.2\d* s old or older")
class StampsLate(HonestGripper):
    def read(self):
        return changed(self, t_ns=lambda t_ns: max(t_ns - 200_000_000, 0))


@caught_device("gripper", FOLLOWS, r"t_ns advanced by 0 s while the clock advanced by 1 s")
class ConstantTime(HonestGripper):
    def read(self):
        return changed(self, t_ns=lambda t_ns: self.connected_ns)


@caught_device("gripper", FOLLOWS, r"t_ns advanced by 0.001 s while the clock advanced by 1 s")
class Microseconds(HonestGripper):
    def read(self):
        return changed(self, t_ns=lambda t_ns: t_ns // 1000)


@caught_device("pose_source", FOLLOWS, "a sample from the future.*not the time of day")
class TimeOfDay(HonestPoses):
    def read(self):
        return changed(self, t_ns=lambda t_ns: time.time_ns())


@caught_device("sensor", FOLLOWS, r"samples are \d.* s old")
class OldFrames(HonestSensor):
    def read(self):
        return changed(self, t_ns=lambda t_ns: t_ns - 3_000_000_000)


@caught_device("sensor", stamps.check_read_repeats_the_newest, r"returned seq \[\d, \d, \d, \d\]; number samples")
class NumbersReads(HonestSensor):
    reads = 0

    def read(self):
        self.reads += 1
        return changed(self, seq=lambda seq: self.reads)


@caught_device("sensor", TOGETHER, "seq went from 7 to 0 .* went back")
class NumberWraps(HonestSensor):
    def read(self):
        return changed(self, seq=lambda seq: seq % 8)


@caught_device("pose_source", TOGETHER, "t_ns is .*, not an int")
class TimeIsAFloat(HonestPoses):
    def read(self):
        return changed(self, t_ns=float)


@caught_device("gripper", TOGETHER, "must go up together")
class StampsTheRead(HonestGripper):
    def read(self):
        return changed(self, t_ns=lambda t_ns: self.clock.now())


@caught_device("pose_source", TOGETHER, "counts from zero")
class CountsDown(HonestPoses):
    def read(self):
        return changed(self, seq=lambda seq: -seq - 1)


@caught_device("sensor", pictures.check_frames_are_not_black, "all frames of the first second are black")
class BlackFrames(HonestSensor):
    def image(self, seq):
        return np.zeros((240, 320, 3), np.uint8)


@caught_device("sensor", pictures.check_colours_are_rgb, "the image is BGR")
class BlueFirst(HonestSensor):
    def image(self, seq):
        return np.ascontiguousarray(super().image(seq)[..., ::-1])


@caught_device("sensor", pictures.check_markers_form_the_pad, "declares 5 x 5 = 25 markers, and the image shows 63")
class WrongPad(HonestSensor):
    spec = small(pad=(5, 5))


@caught_device("sensor", pictures.check_markers_form_the_pad, r"shows 7 rows and 9 columns; pad is \(rows, columns\)")
class SwappedPad(HonestSensor):
    spec = small(pad=(9, 7))


@caught_device("sensor", pictures.check_markers_form_the_pad, "the image shows 0")
class NoMarkers(HonestSensor):
    def image(self, seq):
        return np.full((240, 320, 3), 100, np.uint8)


@caught_device("sensor", SPEC, "makes the gel 20 m wide")
class MillimetresPerPixel(HonestSensor):
    spec = small(metres_per_px=0.0625)


@caught_device("sensor", SPEC, "spec.rate_hz is 0")
class NoRate(HonestSensor):
    spec = small(rate_hz=0.0)


@caught_device("sensor", SPEC, "spec.metres_per_px is nan")
class NoScale(HonestSensor):
    spec = small(metres_per_px=math.nan)


@caught_device("sensor", SPEC, r"spec.pad is \[7, 9\]")
class PadIsAList(HonestSensor):
    spec = small(pad=[7, 9])


@caught_device("sensor", SPEC, "spec is tuple, not SensorSpec")
class SpecIsATuple(HonestSensor):
    spec = (320, 240)


@caught_device("sensor", specs.check_spec_stays_the_same, "the spec was .* and is")
class SpecMeasuresTheRate(HonestSensor):
    @property
    def spec(self):
        return small(rate_hz=25.0 + self.clock.now() * 1e-9)


@caught_device("sensor", FRAMES, r"the image is \(240, 320\)")
class GreyFrames(HonestSensor):
    def image(self, seq):
        return super().image(seq)[..., 0]


@caught_device("sensor", FRAMES, r"the image is \(240, 320, 3\), and the spec declares \(320, 240, 3\)")
class WidthIsHeight(HonestSensor):
    spec = small(width_px=240, height_px=320)


@caught_device("sensor", FRAMES, "the image is float64")
class FloatFrames(HonestSensor):
    def image(self, seq):
        return super().image(seq) / 255


@caught_device("sensor", FRAMES, "came again with another image")
class NewImageSameNumber(HonestSensor):
    reads = 0

    def image(self, seq):
        self.reads += 1
        return super().image(self.reads)


@caught_device("sensor", sensing.check_frame_rate, "give 25.0 Hz, and 60.0 Hz are declared")
class WrongRate(HonestSensor):
    spec = small(rate_hz=60.0)


@caught_device("sensor", sensing.check_frames_are_not_overwritten, "changed a frame that it had returned before")
class ReusesEightBuffers(HonestSensor):
    def image(self, seq):
        if not hasattr(self, "ring"):
            self.ring = [super(ReusesEightBuffers, self).image(0).copy() for _ in range(8)]
        buffer = self.ring[seq % 8]
        buffer[:] = super().image(seq)
        return buffer


@caught_device("sensor", sensing.check_frames_are_not_overwritten, "changed a frame that it had returned before")
class ReusesItsBuffer(HonestSensor):
    def __init__(self, options, context):
        super().__init__(options, context)
        self.buffer = np.zeros((gel.SPEC.height_px, gel.SPEC.width_px, 3), np.uint8)

    def image(self, seq):
        self.buffer[:] = super().image(seq)
        return self.buffer


@caught_device("sensor", sensing.check_same_seed_gives_same_frames, "the same seed give other frames")
class NoiseWithoutASeed(HonestSensor):
    def image(self, seq):
        return super().image(int.from_bytes(np.random.default_rng().bytes(4), "big"))


@caught_device("pose_source", arm_state.check_poses, r"of length 7, not 1")
class LongQuaternion(HonestPoses):
    def pose(self):
        return Pose((0.4, 0.0, 0.1), (0.0, 0.0, 0.0, 7.0))


@caught_device("pose_source", arm_state.check_poses, "412.* m away")
class PosesInMillimetres(HonestPoses):
    def pose(self):
        return Pose((400.0, 0.0, 100.0))


@caught_device("pose_source", arm_state.check_poses, "leave out a body that is not seen")
class UnseenIsNan(HonestPoses):
    def pose(self):
        return Pose((math.nan, 0.0, 0.1))
