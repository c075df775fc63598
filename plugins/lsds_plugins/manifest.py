"""The backends of this package. Listing plugins must not import numpy or cv2, so this module imports neither."""

from __future__ import annotations

from lsds.contracts import BackendSpec, Kind
from lsds.registry import hookimpl

_TRACKERS = "lsds_plugins.trackers"
_LEARNED: dict[Kind, tuple[tuple[str, str], ...]] = {
    "detector": (
        ("random-forest", "trained: the paper's forest"),
        ("gradient-boosting", "trained: the paper's boosted trees"),
        ("logistic", "trained: linear in a window of the field's evidence; the cheapest"),
        ("field-mlp", "trained: a small net on a window of the field's evidence"),
        ("monotone", "trained: logistic in the logarithms of rates"),
        ("onnx", "a trained model of your own (option model)"),
    ),
    "estimator": (
        ("lstm", "trained: the paper's LSTM"),
        ("mlp", "trained: the paper's MLP"),
        ("linear-window", "trained: linear in a window of the field's evidence; the cheapest"),
        ("field-gru", "trained: a small recurrent net on the field's evidence, which knows how sure it is"),
        ("imprint-gru", "trained: the same on imprint and field"),
        ("onnx", "a trained model of your own (option model)"),
    ),
}


@hookimpl
def lsds_backends() -> list[BackendSpec]:
    """Return trackers, detectors, estimators, controllers, jobs and the sensor that replays recordings."""
    return [
        BackendSpec(
            "tracker",
            "lk",
            f"{_TRACKERS}.dotted.backends:lucas_kanade",
            summary="markers by Lucas-Kanade with prediction; tracks or flags motion beyond half a pitch",
        ),
        BackendSpec(
            "tracker",
            "centroid",
            f"{_TRACKERS}.dotted.backends:centroid",
            summary="markers by weighted centroid, with the same prediction and flags",
        ),
        BackendSpec(
            "tracker",
            "dis",
            f"{_TRACKERS}.dis:DenseFlowTracker",
            f"{_TRACKERS}.dis:DenseFlowOptions",
            summary="dense optical flow sampled on a grid, for gels without markers",
        ),
        BackendSpec(
            "detector",
            "threshold",
            "lsds_plugins.detectors.threshold:ThresholdDetector",
            "lsds_plugins.detectors.threshold:ThresholdOptions",
            summary="threshold on the two-frame maximum of v_net",
        ),
        BackendSpec(
            "detector",
            "rigid-residual",
            "lsds_plugins.detectors.rigid_residual:RigidResidualDetector",
            "lsds_plugins.detectors.rigid_residual:RigidResidualOptions",
            summary="untrained: residual of the velocity field after the best rigid or affine motion",
        ),
        BackendSpec(
            "detector",
            "imprint",
            "lsds_plugins.detectors.imprint:ImprintDetector",
            "lsds_plugins.detectors.imprint:ImprintDetectorOptions",
            summary="untrained: motion of the object's imprint against the gel",
        ),
        BackendSpec(
            "detector",
            "fused",
            "lsds_plugins.detectors.fused:FusedDetector",
            "lsds_plugins.detectors.learned:LearnedOptions",
            summary="trained on labelled real and simulated frames: motion of imprint and dots, joined with imprint",
        ),
        BackendSpec(
            "estimator",
            "imprint",
            "lsds_plugins.estimators.imprint:ImprintEstimator",
            "lsds_plugins.estimators.imprint:ImprintOptions",
            summary="untrained: velocity of the object's imprint against the gel, linear and angular, with uncertainty",
        ),
        BackendSpec(
            "estimator",
            "fused",
            "lsds_plugins.estimators.fused:FusedEstimator",
            "lsds_plugins.estimators.fused:FusedOptions",
            summary="motion of the imprint, and a trained model on the dots, joined by their covariances",
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
            "belief",
            "lsds_plugins.controllers.belief:BeliefController",
            "lsds_plugins.controllers.belief:BeliefOptions",
            summary="the least grip at an accepted risk, by one belief about load, friction and slip",
        ),
        BackendSpec(
            "controller",
            "pd",
            "lsds_plugins.controllers.pd:PdController",
            "lsds_plugins.controllers.pd:PdOptions",
            summary="Algorithm 1 of the paper; closes on slip, derivative over measured time",
        ),
        BackendSpec(
            "job",
            "lift",
            "lsds_plugins.jobs.lift:LiftJob",
            summary="demonstration of the paper: look, grasp, settle, lift, hold; options in [task]",
        ),
        BackendSpec(
            "job",
            "shake",
            "lsds_plugins.jobs.shake:ShakeJob",
            "lsds_plugins.jobs.shake:ShakeOptions",
            summary="grip firmly, hold still, lift, shake, lower: the load changes and nothing slips",
        ),
        BackendSpec(
            "job",
            "slide",
            "lsds_plugins.jobs.slide:SlideJob",
            "lsds_plugins.jobs.slide:SlideOptions",
            summary="slide along an object that stands, or turn about it, at a wanted rate",
        ),
        BackendSpec(
            "job",
            "hold",
            "lsds.jobs.hold:HoldJob",
            "lsds.jobs.hold:HoldOptions",
            summary="grip and hold until released; leaves the arm to another program",
        ),
        BackendSpec(
            "job",
            "watch",
            "lsds.jobs.watch:WatchJob",
            "lsds.jobs.watch:WatchOptions",
            summary="observe only; moves no device",
        ),
        BackendSpec(
            "sensor",
            "video",
            "lsds_plugins.replay.video:VideoSensor",
            "lsds_plugins.replay.video:VideoOptions",
            summary="replays a recording: video file, folder or glob pattern of images",
            virtual_time=True,
        ),
        BackendSpec(
            "sensor",
            "recording",
            "lsds_plugins.replay.recording:RecordingSensor",
            "lsds_plugins.replay.recording:RecordingOptions",
            summary="replays one finger of a recorded run (lsds run --record F.mcap)",
            virtual_time=True,
        ),
        *(
            BackendSpec(
                kind,
                name,
                f"lsds_plugins.{kind}s.learned:{name.replace('-', '_')}",
                f"lsds_plugins.{kind}s.learned:LearnedOptions",
                summary=summary,
            )
            for kind, offered in _LEARNED.items()
            for name, summary in offered
        ),
    ]
