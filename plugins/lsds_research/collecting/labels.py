"""Labels of frames: measured from poses with their lag, as on hardware, and the simulated truth."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lsds.calibration.vision.rotation import rotation_of
from lsds.clock import NS_PER_S
from lsds_research.collecting.pose_sync import nearest
from lsds_research.collecting.pose_velocity import PoseVelocity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lsds.contracts import CellTruth, Pose, PoseSample
    from lsds.session.truth_log import TruthLog

MEASURED_SLIP_M_S = 3e-3
"""Threshold of slip for measured velocities, m/s: above the noise of the poses at rest."""
MEASURED_SLIP_RAD_S = 0.05
"""Threshold of slip for measured angular velocities, rad/s: above the noise of the poses at rest."""
TRUE_SLIP_M_S = 1e-3
"""Threshold of slip for true velocities, m/s; chosen."""
TRUE_SLIP_RAD_S = 0.02
"""Threshold of slip for true angular velocities, rad/s; chosen."""
SMOOTHING_S = 0.03
"""Time constant of the exponential smoothing: that of `lsds_research.collecting.pose_velocity`."""
SLOP_NS = 40_000_000
"""Maximum time between a frame and the pose that gives its label."""


class _Slip(NamedTuple):
    """A measured slip velocity (m/s) and rate (rad/s) at the time of the pose that they were measured with, and how far
    the grip has risen along the object by then."""

    t_ns: int
    x_m_s: float
    y_m_s: float
    turn_rad_s: float
    risen_m: float


_UNSEEN = _Slip(0, math.nan, math.nan, math.nan, math.nan)


class SlipLabels:
    """Collects poses and computes the labels at the end. If `measured` is false, there is no pose source, and the truth
    is used, smoothed like the velocity of a pose source.

    `end_m`: how far the grip can rise along the object until its middle is at the object's end. Beyond that, poses do
    not show whether there is contact: in simulation the truth is used; on a real cell a moving frame there is labelled
    unknown."""

    def __init__(self, truth: TruthLog, *, measured: bool, end_m: float = math.inf) -> None:
        self._truth = truth
        self._end_m = end_m
        self._measured = measured
        self._velocity = PoseVelocity(SMOOTHING_S)
        self._angle_rad = 0.0
        self._slid_m = np.zeros(3)
        self._apart_m: NDArray[np.float64] | None = None
        self._upright: NDArray[np.float64] | None = None
        self._slips: list[_Slip] = []

    def see(self, sample: PoseSample) -> None:
        """Add a pose sample; the bodies "gripper" and "object" must be visible.

        On a real cell the gripper's body has its origin between the pads, and is upright in the first sample.
        """
        poses = sample.poses
        if self._slips and sample.t_ns <= self._slips[-1].t_ns:
            return
        if "gripper" not in poses or "object" not in poses:
            return
        apart = np.subtract(poses["gripper"].position_m, poses["object"].position_m)
        turned = 0.0
        if self._truth.samples:
            # The simulated cell slides only vertically, and its camera does not show the gripper's rotation.
            apart[0] = 0.0
        else:
            rotation = rotation_of(poses["gripper"].quaternion_xyzw)
            self._upright = rotation if self._upright is None else self._upright
            apart = (rotation @ self._upright.T).T @ apart
            # Unwrapped beyond half a turn.
            turned = math.remainder(turn_about_normal(poses["gripper"], poses["object"]) - self._angle_rad, math.tau)
        before = apart if self._apart_m is None else self._apart_m
        # Slip is the motion of the object's point between the pads, not of the object's origin.
        middle = (apart + before) / 2
        self._slid_m += apart - before + turned * np.array([middle[2], 0.0, -middle[0]])
        self._apart_m, self._angle_rad = apart, self._angle_rad + turned
        motion = self._velocity.update(sample.t_ns, (float(self._slid_m[0]), self._angle_rad, float(self._slid_m[2])))
        if motion is not None:
            # The grip rises past the object: the object goes down, along +y of the sensor; x points to -x of the base.
            x, rate, z = motion.velocity_m_s
            self._slips.append(_Slip(sample.t_ns, x, z, rate, float(self._slid_m[2])))

    def at(self, times_ns: Sequence[int]) -> dict[str, NDArray[Any]]:
        """Return every label column (frames,)."""
        samples = self._truth.samples
        true = np.array([_true(nearest(samples, t_ns, sys.maxsize)) for t_ns in times_ns]).reshape(-1, 5)
        known = np.isfinite(true[:, 0])
        lets_go = (np.hypot(true[:, 0], true[:, 1]) > TRUE_SLIP_M_S) | (np.abs(true[:, 2]) > TRUE_SLIP_RAD_S)
        columns: dict[str, NDArray[Any]] = {
            "velocity_x_true": true[:, 0],
            "velocity_y_true": true[:, 1],
            "angular_velocity_true": true[:, 2],
            "speed_true": np.hypot(true[:, 0], true[:, 1]),
            "stick_true": true[:, 3],
            "slip_true": np.where(known, lets_go, -1),
        }
        smooth = self._smoothed(times_ns)
        if not self._measured:
            speed = np.hypot(smooth[:, 0], smooth[:, 1])
            moves = (speed > MEASURED_SLIP_M_S) | (np.abs(smooth[:, 2]) > MEASURED_SLIP_RAD_S)
            return columns | {
                "velocity_x": smooth[:, 0],
                "velocity_y": smooth[:, 1],
                "angular_velocity_label": smooth[:, 2],
                "speed": speed,
                "slip": np.where(known, moves, -1),
            }
        slips = [nearest(self._slips, t_ns, SLOP_NS) or _UNSEEN for t_ns in times_ns]
        seen = np.array([slip[1:4] for slip in slips]).reshape(-1, 3)
        if samples:
            # Without contact there is no slip.
            seen[true[:, 4] <= 0] = 0.0
        else:
            past = np.array([slip.risen_m for slip in slips]) > self._end_m
            seen[past & (np.hypot(seen[:, 0], seen[:, 1]) > MEASURED_SLIP_M_S)] = math.nan
        speed = np.hypot(seen[:, 0], seen[:, 1])
        # The simulated cell's camera does not show the gripper's rotation.
        turning = smooth[:, 2] if samples else seen[:, 2]
        slip = np.where(
            np.isfinite(speed), (speed > MEASURED_SLIP_M_S) | (np.nan_to_num(np.abs(turning)) > MEASURED_SLIP_RAD_S), -1
        )
        return columns | {
            "velocity_x": seen[:, 0],
            "velocity_y": seen[:, 1],
            "angular_velocity_label": turning,
            "speed": speed,
            "slip": slip,
        }

    def _smoothed(self, times_ns: Sequence[int]) -> NDArray[np.float64]:
        """Return (frames, 3): the true slip velocity and rate smoothed like those of a pose source, with the same lag.

        Stick and slip alternate within a frame; poses do not resolve this, and the grip cannot correct it.
        """
        samples = self._truth.samples
        if not samples:
            return np.full((len(times_ns), 3), math.nan)
        values = np.array([(*s.slip_velocity_m_s, s.slip_angular_rad_s) for s in samples])
        steps = np.diff([s.t_ns for s in samples], prepend=samples[0].t_ns) / NS_PER_S
        state, found = values[0], np.empty_like(values)
        for k, new in enumerate(1 - np.exp(-steps / SMOOTHING_S)):
            state = state + new * (values[k] - state)
            found[k] = state
        at = np.searchsorted([s.t_ns for s in samples], times_ns).clip(0, len(samples) - 1)
        return np.asarray(found[at], np.float64)


def turn_about_normal(gripper: Pose, thing: Pose) -> float:
    """Return how far (rad) the gripper is turned against an object about the pads' normal, y of the base."""
    apart = rotation_of(gripper.quaternion_xyzw) @ rotation_of(thing.quaternion_xyzw).T
    return math.atan2(apart[0, 2] - apart[2, 0], apart[0, 0] + apart[2, 2])


def _true(truth: CellTruth | None) -> tuple[float, float, float, float, float]:
    if truth is None:
        return math.nan, math.nan, math.nan, math.nan, math.nan
    x, y = truth.slip_velocity_m_s
    return x, y, truth.slip_angular_rad_s, truth.stick_ratio, truth.normal_force_n
