"""Rendered markers with a given motion, and the error of their measured velocity."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from lsds_mocks.scene.stage import DICTIONARY, MARKERS, VIEWPOINT, Stage
from lsds_research.collecting.pose_velocity import PoseVelocity

from lsds.calibration.vision.fiducials import FiducialFinder, Marker
from lsds.contracts.plant_links import Scene

RATE_HZ = 60.0
EXPOSURE_S = 0.004


def finder(stage):
    bodies = {body: {number: Marker(size * 1e-3)} for body, (number, size) in MARKERS.items()}
    return FiducialFinder(stage.camera, DICTIONARY, bodies)


def in_base(found):
    return VIEWPOINT.rotation @ found.position_m + VIEWPOINT.position_m


class Speeds(NamedTuple):
    """Errors of the slip speed (m/s), root mean square: against the truth at the estimate's time, against that at the
    newest picture, and their mean; and the reported lag (s)."""

    rms_m_s: float
    rms_without_lag_m_s: float
    bias_m_s: float
    lag_s: float


def steady(t, peak_m_s=0.04, acceleration_m_s2=0.5):
    """Speed (m/s) and way (m) of an arm that starts at once and then keeps its speed, as in the trials."""
    ramp_s = peak_m_s / acceleration_m_s2
    if t < ramp_s:
        return acceleration_m_s2 * t, 0.5 * acceleration_m_s2 * t * t
    return peak_m_s, peak_m_s * (t - ramp_s / 2)


def swinging(t, peak_m_s=0.04, period_s=0.8):
    """Speed and way of one that goes from rest to its peak and back, over and over: the hardest case for a filter."""
    turn = 2 * np.pi / period_s
    return peak_m_s * 0.5 * (1 - np.cos(turn * t)), peak_m_s * 0.5 * (t - np.sin(turn * t) / turn)


def slip_speeds(time_constant_s, motion=steady, *, settle_s=0.4, width=640, height=480, duration_s=1.6, seed=1):
    """The gripper rises against a resting object; measure how well its speed is seen after `settle_s`.

    The slip velocity is that of the object's marker against the gripper's, as ground truth is taken on a rig.
    """
    stage = Stage(width, height, [seed])
    looking, smooth = finder(stage), PoseVelocity(time_constant_s)
    errors, raw, lags = [], [], []
    for number in range(round(duration_s * RATE_HZ)):
        t = number / RATE_HZ + EXPOSURE_S
        begin, end = (Scene(0, 0.05 + motion(t + half)[1], 0.0) for half in (-EXPOSURE_S / 2, EXPOSURE_S / 2))
        t_ns = round(t * 1e9)
        found = looking.find(stage.render(begin, end, number), t_ns)
        apart = in_base(found["gripper"]) - in_base(found["object"])
        seen = smooth.update(t_ns, tuple(apart))
        if seen is not None and t > settle_s:
            errors.append(seen.velocity_m_s[2] - motion(seen.t_ns / 1e9)[0])
            raw.append(seen.velocity_m_s[2] - motion(t)[0])
            lags.append(seen.lag_s)
    errors, raw = np.array(errors), np.array(raw)
    return Speeds(
        float(np.sqrt((errors**2).mean())), float(np.sqrt((raw**2).mean())), float(errors.mean()), float(np.mean(lags))
    )
