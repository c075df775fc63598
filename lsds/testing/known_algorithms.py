"""Algorithms with known behaviour, for a fault to wrap. Each logs the calls that reach it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from lsds.clock import seconds
from lsds.contracts import (
    Detection,
    Frame,
    Grip,
    MarkerReference,
    MarkerTracks,
    SlipEstimate,
    Twist,
    Wanted,
)
from lsds.testing.known_devices import Part
from lsds.testing.stimulus import cycles, reference

KNOWN_SLIP_M_S = 4e-3
"""Mean speed of the markers above which `KnownDetector` reports slip, m/s; chosen."""


class KnownTracker(Part):
    """A tracker that knows where the markers are."""

    def start(self, frame: Frame, pad: tuple[int, int] | None = None) -> MarkerReference:
        """Return the markers of the gel at rest."""
        self.note("start", pad)
        return reference()

    def update(self, frame: Frame) -> MarkerTracks:
        """Return the markers of a frame of the kit."""
        self.note("update", frame)
        tracks = cycles("slides")[frame.seq].tracks
        copied = {name: getattr(tracks, name).copy() for name in ("xy_px", "valid", "flags")}
        return replace(tracks, **copied)

    def reset(self) -> None:
        """Log the call."""
        self.note("reset")


class KnownDetector(Part):
    """A detector by the mean speed of the markers."""

    def update(self, observation: Any) -> Detection:
        """Return slip above a speed."""
        self.note("update", observation)
        speed_m_s = mean_speed_m_s(observation)
        return Detection(speed_m_s > KNOWN_SLIP_M_S, speed_m_s, KNOWN_SLIP_M_S, 0.5)

    def reset(self) -> None:
        """Log the call."""
        self.note("reset")


class KnownEstimator(Part):
    """An estimator by the mean speed of the markers."""

    def update(self, observation: Any) -> SlipEstimate:
        """Return a velocity along y."""
        self.note("update", observation)
        speed_m_s = mean_speed_m_s(observation)
        return SlipEstimate((0.0, speed_m_s), (1e-3, 1e-3), 0.1, 0.1, speed_m_s, 1e-3)

    def reset(self) -> None:
        """Log the call."""
        self.note("reset")


class KnownController(Part):
    """A controller that closes on slip, and declares all that a controller can declare."""

    may_open = True
    limits_force = True
    held_back = True

    def update(self, grip: Any, wanted: Any) -> float | None:
        """Return a smaller aperture on slip."""
        self.note("update", grip, wanted)
        return grip.commanded_m - 0.02 * grip.estimate.speed_m_s if grip.detection.slip else None

    def reset(self) -> None:
        """Log the call."""
        self.note("reset")


class KnownJob(Part):
    """A job that grasps, lifts and holds by the time of its inputs."""

    stages = ("grasp", "lift", "hold")

    def begin(self, setting: Any) -> None:
        """Log the call."""
        self.note("begin")

    def step(self, now: Any) -> Wanted:
        """Return what is wanted at a time."""
        self.note("step", now.t_ns)
        t_s = seconds(now.t_ns)
        stage = self.stages[0 if t_s < 0.3 else 1 if t_s < 1.5 else 2]
        twist = Twist((0.0, 0.0, 0.05 * t_s)) if stage == "lift" else None
        return Wanted(stage, Grip(0.0285, 0.05, 20.0 + t_s), corrects=stage != "grasp", twist=twist)


def mean_speed_m_s(observation: Any) -> float:
    """Return the mean speed of the markers, 0 if none is known."""
    known = observation.field.velocity_m_s[np.isfinite(observation.field.velocity_m_s).all(axis=1)]
    return float(np.hypot(known[:, 0], known[:, 1]).mean()) if len(known) else 0.0
