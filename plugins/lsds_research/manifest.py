"""The plugin manifest of the research package. It must not import numpy or cv2, so that listing plugins stays fast."""

from __future__ import annotations

from typing import NamedTuple

from lsds.contracts import BackendSpec
from lsds.registry import hookimpl


class MapEntry(NamedTuple):
    """Module in `lsds_research.stability.maps`, imports that it needs with their extra, and summary."""

    module: str
    requires: tuple[str, ...]
    extra: str
    summary: str


_LEARNERS = (
    ("random-forest", "trees:RandomForest", ("sklearn",), "detector: random forest with the paper's settings"),
    ("gradient-boosting", "trees:GradientBoosting", ("sklearn",), "detector: boosted trees with the paper's settings"),
    ("logistic", "linear:Logistic", ("sklearn",), "detector: logistic regression on a window of field signals"),
    ("field-mlp", "field_mlp:FieldMlp", ("torch",), "detector: small neural network on a window of field signals"),
    ("monotone", "monotone:Monotone", ("scipy",), "detector: logistic regression on log rates, weights of one sign"),
    (
        "fused",
        "fused:Fused",
        ("sklearn",),
        "detector: boosted trees on the motion of imprint and markers in the last frames",
    ),
    ("lstm", "paper_nets:Lstm", ("torch",), "estimator: LSTM with the paper's settings"),
    ("mlp", "paper_nets:Mlp", ("torch",), "estimator: MLP with the paper's settings"),
    ("linear-window", "linear:LinearWindow", ("sklearn",), "estimator: ridge regression on a window of field signals"),
    ("field-gru", "field_gru:FieldGru", ("torch",), "estimator: small recurrent net with standard deviations"),
    ("imprint-gru", "field_gru:ImprintGru", ("torch",), "estimator: the same nets on imprint and field"),
)


_STUDIES = (
    (
        "incipient-slip",
        "incipient.study:IncipientStudy",
        "incipient.options:IncipientOptions",
        ("sklearn", "pyarrow"),
        "train",
        "slip or no slip in real recordings, on held-out objects",
    ),
    (
        "slip",
        "slips.study:SlipStudy",
        "slips.options:SlipOptions",
        ("pyarrow",),
        "data",
        "detectors and estimators frame by frame, on real recordings labelled by eye",
    ),
    (
        "models",
        "studies.models.scored:ModelsStudy",
        "studies.models.options:ModelsOptions",
        ("pyarrow",),
        "data",
        "finished models on held-out objects of a dataset, compared with trivial baselines",
    ),
    (
        "grip",
        "studies.grip.study:GripStudy",
        "studies.grip.options:GripOptions",
        ("numba",),
        "sim",
        "controllers on unknown objects: grip over needed, slip, drops",
    ),
    (
        "faults",
        "studies.faults.study:FaultsStudy",
        "studies.faults.options:FaultsOptions",
        ("numba",),
        "sim",
        "parts of the cell that fail while an object is lifted: stopped, harmless or missed",
    ),
    (
        "risk",
        "search.risk:RiskStudy",
        "search.risk_options:RiskOptions",
        ("numba", "scipy"),
        "search",
        "probability of a failure: multilevel splitting over a space of scenarios, or plain counting",
    ),
    (
        "search",
        "search.study:SearchStudy",
        "search.options:SearchOptions",
        ("numba", "cma", "scipy"),
        "search",
        "scenarios in which the cell fails: found, shrunk, saved as files",
    ),
    (
        "certify",
        "certify.study:CertifyStudy",
        "certify.options:CertifyOptions",
        ("numba", "sklearn", "scipy"),
        "search",
        "how likely a rig is to drop an object, with an interval, zones and failures",
    ),
    (
        "slide",
        "studies.slide:SlideStudy",
        "studies.slide:SlideOptions",
        ("numba",),
        "sim",
        "intended slip: how well objects slide and turn at the commanded rate",
    ),
    (
        "loop",
        "studies.loop.study:LoopStudy",
        "studies.loop.options:LoopOptions",
        ("numba",),
        "sim",
        "whole configurations: computing time of a frame against slip and steady grip",
    ),
    (
        "learning",
        "studies.models.curve:LearningStudy",
        "studies.models.options:LearningOptions",
        ("sklearn", "torch", "pyarrow"),
        "train",
        "scores on held-out objects against the number of training objects",
    ),
    (
        "detectors",
        "studies.models.tradeoff:detectors",
        "studies.models.options:DetectorsOptions",
        ("sklearn", "torch", "onnx", "pyarrow"),
        "train",
        "detectors on held-out objects: accuracy against computing time",
    ),
    (
        "estimators",
        "studies.models.tradeoff:estimators",
        "studies.models.options:EstimatorsOptions",
        ("sklearn", "torch", "onnx", "pyarrow"),
        "train",
        "estimators on held-out objects: R2 against computing time",
    ),
    (
        "frame",
        "studies.frame.study:FrameStudy",
        "studies.frame.options:FrameOptions",
        ("numba",),
        "sim",
        "computing time of one frame from image to command, by part; trackers compared with peers",
    ),
    (
        "scheduler",
        "studies.scheduler_cost:SchedulerStudy",
        "studies.scheduler_cost:SchedulerOptions",
        (),
        "",
        "overhead of the scheduler, compared with the standard library's",
    ),
    (
        "gel",
        "studies.gel.study:GelStudy",
        "studies.gel.options:GelStudyOptions",
        ("numba",),
        "sim",
        "speed against accuracy of the gel models",
    ),
    (
        "optics",
        "studies.optics.study:OpticsStudy",
        "studies.optics.options:OpticsOptions",
        ("numba",),
        "sim",
        "computing time of mechanics and image of one frame, and colour error, by optical tier",
    ),
)

_SIM = (("numba",), "sim")
STABILITY_MAPS = {
    "marker-travel": MapEntry("marker_travel", (), "", "trackers: markers confused, by their travel per frame"),
    "markers-lost": MapEntry("markers_lost", (), "", "trackers: markers confused, by the share that vanishes"),
    "integrators": MapEntry(
        "integrators", (), "", "integrators of dry friction: error of a drop, by step and stiffness"
    ),
    "loop-delay": MapEntry("loop_delay", *_SIM, "slip of a lift, by delay of the gripper and margin or gain"),
    "frame-rate": MapEntry("frame_rate", *_SIM, "slip of a lift, by frame interval and lost frames"),
    "frame-jitter": MapEntry("frame_jitter", *_SIM, "slip of a lift, by frame interval and jitter"),
    "false-alarms": MapEntry("false_alarms", *_SIM, "grip over the needed one, by false alarms and time of the hold"),
    "friction-ticks": MapEntry("friction_ticks", *_SIM, "grip over the needed one, by friction ratio and tick size"),
    "spheres": MapEntry("spheres", *_SIM, "slip of spheres, by diameter and mass"),
    "camera": MapEntry("camera", *_SIM, "slip of a lift, by worn markers and swinging light"),
    "image": MapEntry("image", *_SIM, "slip of a lift, by blur and drift of the gain"),
    "edge": MapEntry("edge", *_SIM, "slip of a lift, by the uncovered part of the pad and friction"),
    "texture": MapEntry("texture", *_SIM, "slip of a flat object, by depth of its texture and friction"),
    "imprint": MapEntry("imprint", *_SIM, "slip frames not found, by depth of the texture and speed"),
    "turning": MapEntry("turning", *_SIM, "error of the rate of turning slip, by rate and frame interval"),
    "gel-models": MapEntry(
        "gel_models", *_SIM, "error of the markers, by radius of the patch and distance to the wall"
    ),
}
"""The stability maps by name."""

_MAPS = (
    (
        "stability",
        "stability.overview:AllMapsStudy",
        "stability.options:AllMapsOptions",
        *_SIM,
        "all stability maps: the safe share of each method",
    ),
    *(
        (
            f"stability-{name}",
            f"stability.maps.{each.module}:study",
            "stability.options:StabilityOptions",
            each.requires,
            each.extra,
            f"map: {each.summary}",
        )
        for name, each in STABILITY_MAPS.items()
    ),
)

_COMMANDS = (
    ("learn", "collect", ("pyarrow",), "data", "Record a dataset by a protocol of the paper."),
    ("learn", "label", (), "plot", "Label slip in recordings by eye, frame by frame."),
    (
        "learn",
        "train",
        ("pyarrow", "sklearn", "torch"),
        "train",
        "Fit a detector or an estimator and write its ONNX model.",
    ),
    ("study", "choose", ("numba",), "sim", "cheapest rig file within limits of slip and grip"),
    ("study", "reproduce", ("pyarrow", "sklearn", "torch"), "train", "the paper's tables on simulated data"),
)
"""Commands by group."""


@hookimpl
def lsds_backends() -> list[BackendSpec]:
    """Return the commands, studies, learners and the collecting job of research."""
    commands = [
        BackendSpec(
            "command", name, f"lsds_research.cli.{name}:{name}", summary=text, requires=needs, extra=extra, group=group
        )
        for group, name, needs, extra, text in _COMMANDS
    ]
    studies = [
        BackendSpec(
            "study",
            name,
            f"lsds_research.{factory}",
            f"lsds_research.{options}",
            summary=summary,
            requires=requires,
            extra=extra,
        )
        for name, factory, options, requires, extra, summary in (*_STUDIES, *_MAPS)
    ]
    learners = [
        BackendSpec(
            "learner",
            name,
            f"lsds_research.learners.{target}",
            f"lsds_research.learners.{target}Options",
            summary=summary,
            requires=(*requires, "onnx"),
            extra="train",
        )
        for name, target, requires, summary in _LEARNERS
    ]
    trial = BackendSpec(
        "job",
        "trial",
        "lsds_research.collecting.job:trial_job",
        "lsds_research.collecting.job:TrialOptions",
        summary="make one recording by a protocol of lsds learn collect",
    )
    return [trial, *commands, *studies, *learners]
