"""What this package offers to lsds. Light on purpose: listing plugins must not import numpy or cv2."""

from __future__ import annotations

from lsds.contracts import BackendSpec
from lsds.plugins import hookimpl

_TRACKERS = "lsds_plugins.trackers"


@hookimpl
def lsds_backends() -> list[BackendSpec]:
    """Return trackers, detectors, estimators, controllers and the sensor that replays recordings."""
    return [
        BackendSpec(
            "tracker",
            "lk",
            f"{_TRACKERS}.dots:lucas_kanade",
            summary="dots by Lucas-Kanade with prediction; follows or flags travel beyond half a pitch",
        ),
        BackendSpec(
            "tracker",
            "centroid",
            f"{_TRACKERS}.dots:centroid",
            summary="dots by weighted centroid, with the same prediction and flags",
        ),
        BackendSpec(
            "tracker",
            "dis",
            f"{_TRACKERS}.dis:DenseFlowTracker",
            f"{_TRACKERS}.dis:DenseFlowOptions",
            summary="dense optical flow sampled on a grid, for gels without dots",
        ),
        BackendSpec(
            "detector",
            "threshold",
            "lsds_plugins.detectors.threshold:ThresholdDetector",
            "lsds_plugins.detectors.threshold:ThresholdOptions",
            summary="two-frame maximum of v_net against one number",
        ),
        BackendSpec(
            "detector",
            "rigid-residual",
            "lsds_plugins.detectors.rigid_residual:RigidResidualDetector",
            "lsds_plugins.detectors.rigid_residual:RigidResidualOptions",
            summary="untrained: what the best rigid or affine motion leaves of the field",
        ),
        BackendSpec(
            "estimator",
            "field",
            "lsds_plugins.estimators.field:FieldEstimator",
            "lsds_plugins.estimators.field:FieldOptions",
            summary="windowed regression on the field: linear and angular velocity with uncertainty",
        ),
        BackendSpec(
            "controller",
            "pd",
            "lsds_plugins.controllers.pd:PdController",
            "lsds_plugins.controllers.pd:PdOptions",
            summary="the paper's Algorithm 1, closing on slip, derivative scaled by measured time",
        ),
        BackendSpec(
            "sensor",
            "video",
            "lsds_plugins.replay.video:VideoSensor",
            "lsds_plugins.replay.video:VideoOptions",
            summary="a recording: video file, or folder or pattern of images",
            virtual_time=True,
        ),
    ]
