"""The catalogue of faults. It imports no heavy module, because listing plugins reads it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Entry:
    """A fault: its name, its factory within `lsds_mocks.faults` and its effect.

    `levels` are the values of the five severities, in `unit`; empty if the fault has no scale. A `malformed` fault
    changes the type or the shape of the returned value, or raises an exception that is not an `LsdsError`.
    """

    name: str
    factory: str
    summary: str
    levels: tuple[float, ...] = ()
    unit: str = ""
    malformed: bool = False

    @property
    def target(self) -> str:
        """The kind of part that it affects: the first word of its name."""
        return self.name.partition("-")[0]


FAULT_SHARES = (0.05, 0.1, 0.2, 0.5, 1.0)
"""Levels of faults that affect a share of the frames or answers, weakest first; chosen."""
DELAYS_S = (0.02, 0.05, 0.1, 0.2, 0.5)
"""Levels of faults that delay frames or commands, s, weakest first; chosen."""
FRAME_COUNTS = (1, 2, 4, 8, 16)
"""Levels of faults that return the answer of an earlier frame, frames, weakest first; chosen."""

CATALOGUE = (
    # -- camera: images
    Entry(
        "camera-dark", "images:dark", "the image darkens, at last to black", (0.3, 0.6, 0.8, 0.95, 1.0), "of the light"
    ),
    Entry("camera-bright", "images:bright", "the image is over-exposed", (1.3, 1.8, 2.5, 4.0, 10.0), "times the light"),
    Entry("camera-no-red", "images:no_red", "red fades", (0.2, 0.5, 0.8, 0.95, 1.0), "of it"),
    Entry("camera-no-green", "images:no_green", "green fades", (0.2, 0.5, 0.8, 0.95, 1.0), "of it"),
    Entry("camera-no-blue", "images:no_blue", "blue fades", (0.2, 0.5, 0.8, 0.95, 1.0), "of it"),
    Entry("camera-gain", "images:gain", "the gain drifts", (0.02, 0.05, 0.1, 0.3, 1.0), "a second"),
    Entry(
        "camera-flicker", "images:flicker", "the light flickers at 7 Hz", (0.02, 0.05, 0.1, 0.3, 0.6), "of the light"
    ),
    Entry("camera-noise", "images:noise", "noise grows", (3, 6, 12, 25, 50), "levels"),
    Entry("camera-blur", "images:blur", "the image loses its focus", (0.5, 1, 2, 4, 8), "px"),
    Entry("camera-moved", "images:moved", "the image jumps sideways", (1, 3, 7, 15, 40), "px"),
    Entry(
        "camera-torn", "images:torn", "the lower rows are grey: a torn JPEG", (0.05, 0.15, 0.3, 0.5, 0.9), "of the rows"
    ),
    Entry("camera-bgr", "images:bgr", "red and blue are exchanged"),
    Entry("camera-small", "images:small", "the image has half the size", malformed=True),
    Entry("camera-float", "images:as_float", "the image is of floats", malformed=True),
    Entry("camera-scar", "images:scar", "a scar runs over the gel", (1, 2, 4, 8, 16), "px wide"),
    Entry(
        "camera-stuck-dots",
        "images:stuck_dots",
        "a part of the gel does not move any more",
        (0.05, 0.1, 0.2, 0.4, 0.8),
        "of it",
    ),
    Entry("camera-loose-gel", "images:loose_gel", "the gel slides off its window", (5, 20, 50, 100, 300), "px/s"),
    # -- camera: frame stream
    Entry("camera-frozen", "stream:frozen", "no new frame comes"),
    Entry("camera-repeats", "stream:repeats", "frames come, all with the last image"),
    Entry("camera-late", "stream:late", "frames come later, stamped truly", DELAYS_S, "s"),
    Entry("camera-late-unsaid", "stream:late_unsaid", "frames come later, stamped as new", DELAYS_S, "s"),
    Entry("camera-drops", "stream:drops", "frames are lost", (0.1, 0.2, 0.4, 0.7, 0.95), "of them"),
    Entry(
        "camera-duplicates", "stream:duplicates", "frames show the image before", (0.1, 0.2, 0.4, 0.7, 0.95), "of them"
    ),
    Entry("camera-swaps", "stream:swaps", "frames change places", FAULT_SHARES, "of them"),
    Entry("camera-jitter", "stream:jitter", "time stamps scatter", (0.002, 0.005, 0.01, 0.02, 0.04), "s"),
    Entry("camera-clock", "stream:clock_step", "the camera's clock steps forward", (0.02, 0.1, 0.5, 5.0, 3600.0), "s"),
    Entry(
        "camera-clock-back", "stream:clock_back", "the camera's clock steps back", (0.02, 0.1, 0.5, 5.0, 3600.0), "s"
    ),
    Entry("camera-garbled", "stream:garbled", "frames cannot be decoded", FAULT_SHARES, "of them"),
    Entry("camera-gone", "stream:gone", "the camera is disconnected"),
    # -- gripper
    Entry("gripper-time-out", "gripper:time_out", "answers do not come", FAULT_SHARES, "of them"),
    Entry("gripper-crc", "gripper:crc", "answers have a wrong check sum", FAULT_SHARES, "of them"),
    Entry("gripper-refuses", "gripper:refuses", "it answers each command with an exception"),
    Entry("gripper-fault", "gripper:own_fault", "it reports an internal fault and stands still"),
    Entry("gripper-no-power", "gripper:no_power", "it has lost its power: nothing moves, nothing answers"),
    Entry(
        "gripper-offset",
        "gripper:offset",
        "it reports an aperture that is too large",
        (1e-4, 3e-4, 1e-3, 3e-3, 1e-2),
        "m",
    ),
    Entry("gripper-slow", "gripper:slow", "it moves more slowly", (0.7, 0.4, 0.2, 0.1, 0.02), "of the speed"),
    Entry("gripper-weak", "gripper:weak", "it pushes with less force", (0.8, 0.5, 0.2, 0.1, 0.05), "of the force"),
    Entry("gripper-late", "gripper:late", "commands come later", DELAYS_S, "s"),
    Entry("gripper-coarse", "gripper:coarse", "its ticks are coarser", (3e-4, 5e-4, 1e-3, 2e-3, 4e-3), "m"),
    Entry("gripper-loses", "gripper:loses", "commands are lost", (0.05, 0.1, 0.2, 0.5, 0.9), "of them"),
    Entry("gripper-stuck", "gripper:stuck", "the fingers do not move any more"),
    Entry("gripper-lies", "gripper:lies", "the fingers do not move, but it reports that they did"),
    Entry("gripper-frozen", "gripper:frozen", "it reports a frozen state"),
    # -- arm
    Entry("arm-protective-stop", "arm:protective_stop", "the arm stops by itself"),
    Entry("arm-frozen", "arm:frozen", "it reports a frozen state"),
    Entry("arm-lags", "arm:lags", "commands come later", DELAYS_S, "s"),
    Entry("arm-slow", "arm:slow", "it moves more slowly than commanded", (0.9, 0.7, 0.5, 0.2, 0.0), "of the speed"),
    Entry("arm-gone", "arm:gone", "it is disconnected"),
    # -- algorithms
    Entry("tracker-raises", "algorithms:tracker_raises", "it raises an exception", malformed=True),
    Entry("tracker-nan", "algorithms:tracker_nan", "its positions are NaN"),
    Entry("tracker-loses", "algorithms:tracker_loses", "it loses dots", (0.1, 0.2, 0.5, 0.8, 1.0), "of them"),
    Entry("tracker-wrong", "algorithms:tracker_wrong", "it returns half of the dots", malformed=True),
    Entry("detector-raises", "algorithms:detector_raises", "it raises an exception", malformed=True),
    Entry("detector-none", "algorithms:detector_none", "it returns nothing", malformed=True),
    Entry("detector-nan", "algorithms:detector_nan", "its score is NaN"),
    Entry("detector-late", "algorithms:detector_late", "its answers are of earlier frames", FRAME_COUNTS, "frames"),
    Entry("detector-silent", "algorithms:detector_silent", "it never detects a slip"),
    Entry("detector-alarms", "algorithms:detector_alarms", "it calls frames slip", FAULT_SHARES, "of them"),
    Entry("estimator-raises", "algorithms:estimator_raises", "it raises an exception", malformed=True),
    Entry("estimator-wrong", "algorithms:estimator_wrong", "it returns a list", malformed=True),
    Entry("estimator-nan", "algorithms:estimator_nan", "its numbers are NaN"),
    Entry("estimator-late", "algorithms:estimator_late", "its answers are of earlier frames", FRAME_COUNTS, "frames"),
    Entry("estimator-scale", "algorithms:estimator_scale", "its speeds are too great", (1.5, 3, 10, 30, 100), "times"),
    Entry("controller-raises", "algorithms:controller_raises", "it raises an exception", malformed=True),
    Entry("controller-wrong", "algorithms:controller_wrong", "it returns a text", malformed=True),
    Entry("controller-nan", "algorithms:controller_nan", "it commands NaN"),
    Entry(
        "controller-late", "algorithms:controller_late", "its commands are of earlier frames", FRAME_COUNTS, "frames"
    ),
    # -- observers
    Entry("observer-raises", "observers:raises", "an observer raises an exception"),
    Entry("observer-disk-full", "observers:disk_full", "an observer's disk is full"),
)
