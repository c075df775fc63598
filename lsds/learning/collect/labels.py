"""Labels of frames: measured through poses as on hardware, lag included, and the simulator's truth beside them."""

from __future__ import annotations

import math
from bisect import bisect_left
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.pose_velocity import PoseVelocity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lsds.contracts import CellTruth, PoseSample
    from lsds.truth_log import TruthLog

SLIP_M_S, SLIP_RAD_S = 3e-3, 0.05
"""Measured faster than this is slip: above what the poses' noise makes of rest."""
TRUE_SLIP_M_S, TRUE_SLIP_RAD_S = 1e-3, 0.02
SLOP_NS = 40_000_000
"""A frame has the label of the pose nearest in time, if there is one within this."""


class SlipLabels:
    """Gathers poses; tells labels at the end. `measured` false: there is no pose source, the truth serves for both."""

    def __init__(self, truth: TruthLog, *, measured: bool) -> None:
        self._truth = truth
        self._measured = measured
        self._velocity = PoseVelocity()
        self._times_ns: list[int] = []
        self._slips: list[tuple[float, float]] = []

    def see(self, sample: PoseSample) -> None:
        """Take a pose sample; bodies "gripper" and "object" have to be in sight."""
        poses = sample.poses
        if self._times_ns and sample.t_ns <= self._times_ns[-1]:
            return
        if "gripper" not in poses or "object" not in poses:
            return
        apart = [g - o for g, o in zip(poses["gripper"].position_m, poses["object"].position_m, strict=True)]
        motion = self._velocity.update(sample.t_ns, (apart[0], apart[1], apart[2]))
        if motion is not None:
            self._times_ns.append(sample.t_ns)
            # The grip rises past the object: the object goes down, along +y of the sensor.
            self._slips.append((0.0, motion.velocity_m_s[2]))

    def at(self, times_ns: Sequence[int]) -> dict[str, NDArray[Any]]:
        """Return every label column (frames,)."""
        truths = [self._nearest_truth(t_ns) for t_ns in times_ns]
        true = np.array([_true(truth) for truth in truths]).reshape(-1, 5)
        known = np.isfinite(true[:, 0])
        slips = (np.hypot(true[:, 0], true[:, 1]) > TRUE_SLIP_M_S) | (np.abs(true[:, 2]) > TRUE_SLIP_RAD_S)
        columns: dict[str, NDArray[Any]] = {
            "velocity_x_true": true[:, 0],
            "velocity_y_true": true[:, 1],
            "angular_velocity_true": true[:, 2],
            "speed_true": np.hypot(true[:, 0], true[:, 1]),
            "stick_true": true[:, 3],
            "slip_true": np.where(known, slips, -1),
        }
        if not self._measured:
            return columns | {
                "velocity_x": true[:, 0], "velocity_y": true[:, 1], "angular_velocity_label": true[:, 2],
                "speed": columns["speed_true"], "slip": columns["slip_true"],
            }  # fmt: skip
        seen = np.array([self._nearest_pose(t_ns) for t_ns in times_ns]).reshape(-1, 2)
        # Where pads and object are apart there is nothing to slip: the grip's own contact says so.
        touching = ~(true[:, 4] <= 0)
        seen[~touching] = 0.0
        speed = np.hypot(seen[:, 0], seen[:, 1])
        turning = np.nan_to_num(np.abs(true[:, 2])) > SLIP_RAD_S
        slip = np.where(np.isfinite(speed), (speed > SLIP_M_S) | turning, -1)
        return columns | {
            "velocity_x": seen[:, 0], "velocity_y": seen[:, 1], "angular_velocity_label": true[:, 2],
            "speed": speed, "slip": slip,
        }  # fmt: skip

    def _nearest_truth(self, t_ns: int) -> CellTruth | None:
        samples = self._truth.samples
        after = bisect_left(samples, t_ns, key=lambda sample: sample.t_ns)
        near = samples[max(0, after - 1) : after + 1]
        return min(near, key=lambda sample: abs(sample.t_ns - t_ns), default=None)

    def _nearest_pose(self, t_ns: int) -> tuple[float, float]:
        after = bisect_left(self._times_ns, t_ns)
        near = [k for k in (after - 1, after) if 0 <= k < len(self._times_ns)]
        best = min(near, key=lambda k: abs(self._times_ns[k] - t_ns), default=None)
        if best is None or abs(self._times_ns[best] - t_ns) > SLOP_NS:
            return math.nan, math.nan
        return self._slips[best]


def _true(truth: CellTruth | None) -> tuple[float, float, float, float, float]:
    if truth is None:
        return (math.nan,) * 5
    x, y = truth.slip_velocity_m_s
    return x, y, truth.slip_angular_rad_s, truth.stick_ratio, truth.normal_force_n
