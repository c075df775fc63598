"""Small algorithms that keep their contracts; the mutants are these with one mistake each."""

from __future__ import annotations

import math

import numpy as np

from lsds.contracts import (
    ABSTAINED,
    Detection,
    Grip,
    MarkerReference,
    MarkerTracks,
    SlipEstimate,
    TrackFlag,
    Twist,
    Wanted,
)
from lsds.errors import DataError

ABSTAINS = Detection(None, math.nan, 1e-3, 0.0)


def speed_of(observation):
    """Return the mean speed (m/s) of the markers, NaN if none is known."""
    known = observation.field.velocity_m_s[np.isfinite(observation.field.velocity_m_s).all(axis=1)]
    return float(np.linalg.norm(known, axis=1).mean()) if len(known) else math.nan


class HonestDetector:
    def __init__(self, options, context):
        self.context = context
        self.reset()

    def reset(self):
        self.last = 0.0

    def update(self, observation):
        speed = speed_of(observation)
        if math.isnan(speed):
            return ABSTAINS
        score, self.last = max(speed, self.last), speed
        return Detection(score > 4e-3, score, 4e-3, 0.5)


class HonestEstimator:
    GAIN = 5.0

    def __init__(self, options, context):
        self.reset()

    def reset(self):
        self.speeds = []

    def update(self, observation):
        speed = speed_of(observation)
        if math.isnan(speed):
            return ABSTAINED
        self.speeds = [*self.speeds, speed][-3:]
        mean = self.GAIN * sum(self.speeds) / len(self.speeds)
        return SlipEstimate((0.0, mean), (1e-3, 1e-3), 0.0, 0.1, mean, 1e-3)


class HonestTracker:
    """Uses the dark pixels around the last place of each marker."""

    REACH, LEAST = 12, 60.0

    def __init__(self, options, context):
        self.reference = None

    def start(self, frame, pad=None):
        rows, columns = pad
        row, column = np.divmod(np.arange(rows * columns), columns)
        guess = np.stack([159.5 + 32 * (column - (columns - 1) / 2), 119.5 + 32 * (row - (rows - 1) / 2)], axis=1)
        xy = self._found(frame, guess)
        if np.isnan(xy).any():
            raise DataError(f"reference frame {frame.seq}: no markers (is the sensor lit?)")
        height, width = frame.image.shape[:2]
        cell = np.stack([row, column], axis=1)
        self.reference = MarkerReference(xy, cell, pad, (32.0, 32.0), np.eye(2), (width, height))
        self.reset()
        return self.reference

    def reset(self):
        self.last = self.reference.xy_px.copy()

    def update(self, frame):
        xy = self._found(frame, self.last)
        valid = np.isfinite(xy).all(axis=1)
        self.last = np.where(valid[:, None], xy, self.last)
        flags = np.where(valid, TrackFlag.OK.value, TrackFlag.LOST.value).astype(np.uint8)
        return MarkerTracks(frame.t_ns, frame.seq, xy, valid, flags)

    def _found(self, frame, guess):
        grey = frame.image.mean(axis=2)
        dark = np.clip(0.65 * np.median(grey) - grey, 0, None)
        found = np.full(guess.shape, np.nan)
        for i, (x, y) in enumerate(np.rint(guess).astype(int)):
            left, top = max(x - self.REACH, 0), max(y - self.REACH, 0)
            patch = dark[top : y + self.REACH + 1, left : x + self.REACH + 1]
            total = patch.sum()
            if total > self.LEAST:
                across, down = np.arange(patch.shape[1]) + left, np.arange(patch.shape[0]) + top
                found[i] = (patch.sum(axis=0) @ across) / total, (patch.sum(axis=1) @ down) / total
        return found


class HonestController:
    may_open = True
    limits_force = False

    def __init__(self, options, context):
        self.reset()

    def reset(self):
        self.quiet_s = 0.0

    def update(self, grip, wanted):
        if grip.detection.slip:
            self.quiet_s = 0.0
            speed = grip.estimate.speed_m_s
            return max(0.0, grip.commanded_m - (1e-3 if math.isnan(speed) else 0.1 * speed))
        if grip.detection.slip is None or not grip.dt_s > 0:
            return None
        self.quiet_s += grip.dt_s
        return grip.commanded_m + 1e-3 * grip.dt_s if self.quiet_s > 0.5 else None


class HonestJob:
    stages = ("reference", "grasp", "lift", "done")
    speed_m_s = 0.05

    def __init__(self, options, context):
        self.stage = ""

    def begin(self, setting):
        self.task, self.stage, self.since_ns = setting.task, "reference", setting.t_ns

    def step(self, now):
        if self.stage == "reference" and now.referenced:
            self.stage = "grasp"
        elif self.stage == "grasp" and now.arrived:
            self.stage, self.since_ns = "lift", now.t_ns
        elif self.stage == "lift" and now.t_ns - self.since_ns > 1_000_000_000:
            self.stage = "done"
        grip = Grip(0.029, 0.05, 60.0) if self.stage == "grasp" else None
        twist = Twist((0.0, 0.0, self.speed_m_s)) if self.stage == "lift" else None
        return Wanted(self.stage, grip=grip, twist=twist, done=self.stage == "done")
