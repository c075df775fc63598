"""What the research package offers to lsds. Light on purpose: listing plugins must not import numpy or cv2."""

from __future__ import annotations

from lsds.contracts import BackendSpec
from lsds.plugins import hookimpl

_LEARNERS = (
    ("random-forest", "trees:RandomForest", ("sklearn",), "detector: random forest, the paper's settings"),
    ("gradient-boosting", "trees:GradientBoosting", ("sklearn",), "detector: boosted trees, the paper's settings"),
    ("logistic", "linear:Logistic", ("sklearn",), "detector: logistic regression on a window of the field's evidence"),
    ("field-mlp", "field_mlp:FieldMlp", ("torch",), "detector: a small net on a window of the field's evidence"),
    ("monotone", "monotone:Monotone", ("scipy",), "detector: logistic in the logarithms of rates, weights of one sign"),
    ("lstm", "paper_nets:Lstm", ("torch",), "estimator: LSTM, the paper's settings"),
    ("mlp", "paper_nets:Mlp", ("torch",), "estimator: MLP, the paper's settings"),
    ("linear-window", "linear:LinearWindow", ("sklearn",), "estimator: ridge on a window of the field's evidence"),
    ("field-gru", "field_gru:FieldGru", ("torch",), "estimator: a small recurrent net that knows how sure it is"),
)


_STUDIES = (
    (
        "incipient-slip",
        "incipient.study:IncipientStudy",
        "incipient.options:IncipientOptions",
        ("sklearn", "pyarrow"),
        "train",
        "real recordings: slip or not, on objects never trained on",
    ),
    (
        "models",
        "studies.models.scored:ModelsStudy",
        "studies.models.options:ModelsOptions",
        ("pyarrow",),
        "data",
        "models as they are on a dataset's objects not learnt from, next to the trivial rules",
    ),
    (
        "learning",
        "studies.models.curve:LearningStudy",
        "studies.models.options:LearningOptions",
        ("sklearn", "torch", "pyarrow"),
        "train",
        "scores on objects never seen by the number of objects to learn from",
    ),
    (
        "detectors",
        "studies.models.tradeoff:detectors",
        "studies.models.options:DetectorsOptions",
        ("sklearn", "torch", "onnx", "pyarrow"),
        "train",
        "detectors on objects never seen: accuracy against microseconds",
    ),
    (
        "estimators",
        "studies.models.tradeoff:estimators",
        "studies.models.options:EstimatorsOptions",
        ("sklearn", "torch", "onnx", "pyarrow"),
        "train",
        "estimators on objects never seen: R2 against microseconds",
    ),
    (
        "frame",
        "studies.frame.study:FrameStudy",
        "studies.frame.options:FrameOptions",
        ("numba",),
        "sim",
        "one frame from image to command, part by part; trackers next to their peers",
    ),
    (
        "scheduler",
        "studies.scheduler_cost:SchedulerStudy",
        "studies.scheduler_cost:SchedulerOptions",
        (),
        "",
        "overhead of the scheduler, next to the standard library's",
    ),
    (
        "gel",
        "studies.gel.study:GelStudy",
        "studies.gel.options:GelStudyOptions",
        ("numba",),
        "sim",
        "speed against accuracy of the simulated gel's models",
    ),
    (
        "dynamics",
        "studies.dynamics.study:DynamicsStudy",
        "studies.dynamics.options:DynamicsOptions",
        (),
        "",
        "integrators of dry friction when a grip is lost and regained: where they fail",
    ),
    (
        "optics",
        "studies.optics.study:OpticsStudy",
        "studies.optics.options:OpticsOptions",
        ("numba",),
        "sim",
        "a finger's frame: time of mechanics and image, error of its colours, by optical tier",
    ),
    (
        "realism",
        "studies.realism.study:RealismStudy",
        "studies.realism.options:RealismOptions",
        ("numba",),
        "sim",
        "recordings and simulated clips side by side: motion, divergence, curl, lost dots",
    ),
)

_COMMANDS = (
    ("collect", ("pyarrow",), "data", "Record data to learn from, by the protocols of the study."),
    (
        "train",
        ("pyarrow", "sklearn", "torch"),
        "train",
        "Fit a detector or an estimator, and write the model that a cell runs.",
    ),
    ("evaluate", ("pyarrow",), "data", "Score models on data that they have not seen, real recordings above all."),
    (
        "reproduce",
        ("pyarrow", "sklearn", "torch"),
        "train",
        "Measure the study's tables on simulated data, next to the printed ones.",
    ),
)


@hookimpl
def lsds_backends() -> list[BackendSpec]:
    """Return commands, studies, learners and the job that collects."""
    commands = [
        BackendSpec("command", name, f"lsds_research.cli.{name}:{name}", summary=text, requires=needs, extra=extra)
        for name, needs, extra, text in _COMMANDS
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
        for name, factory, options, requires, extra, summary in _STUDIES
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
        summary="one recording of a protocol of lsds collect",
    )
    return [trial, *commands, *studies, *learners]
