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


@hookimpl
def lsds_backends() -> list[BackendSpec]:
    """Return learners, studies and the job that collects."""
    return [
        BackendSpec(
            "job",
            "trial",
            "lsds_research.collecting.job:trial_job",
            "lsds_research.collecting.job:TrialOptions",
            summary="one recording of a protocol of lsds collect",
        ),
        BackendSpec(
            "study",
            "incipient-slip",
            "lsds_research.incipient.study:IncipientStudy",
            "lsds_research.incipient.options:IncipientOptions",
            summary="real recordings: slip or not, on objects never trained on, beside what knows nothing",
            requires=("sklearn", "pyarrow"),
            extra="train",
        ),
        BackendSpec(
            "study",
            "models",
            "lsds_research.studies.learned.scored:ModelsStudy",
            "lsds_research.studies.learned.scored:ModelsOptions",
            summary="models as they are on a dataset's objects not learnt from, beside the trivial rules",
            requires=("pyarrow",),
            extra="data",
        ),
        BackendSpec(
            "study",
            "learning",
            "lsds_research.studies.learned.curve:LearningStudy",
            "lsds_research.studies.learned.curve:LearningOptions",
            summary="scores on objects never seen by the number of objects to learn from",
            requires=("sklearn", "torch", "pyarrow"),
            extra="train",
        ),
        *(
            BackendSpec(
                "study",
                f"{kind}s",
                f"lsds_research.studies.learned.study:{kind}s",
                "lsds_research.studies.learned.study:BrainOptions",
                summary=f"{kind}s on objects never seen: accuracy against microseconds",
                requires=("sklearn", "torch", "onnx", "pyarrow"),
                extra="train",
            )
            for kind in ("detector", "estimator")
        ),
        BackendSpec(
            "study",
            "gel",
            "lsds_research.studies.gel.study:GelStudy",
            "lsds_research.studies.gel.options:GelStudyOptions",
            summary="speed against accuracy of the simulated gel's models",
        ),
        BackendSpec(
            "study",
            "dynamics",
            "lsds_research.studies.dynamics.study:DynamicsStudy",
            "lsds_research.studies.dynamics.study:DynamicsOptions",
            summary="integrators of dry friction when a grip is lost and regained: where they fail",
        ),
        BackendSpec(
            "study",
            "optics",
            "lsds_research.studies.optics:OpticsStudy",
            "lsds_research.studies.optics:OpticsOptions",
            summary="a finger's frame: time of mechanics and image, error of its colours, by optical tier",
        ),
        BackendSpec(
            "study",
            "realism",
            "lsds_research.studies.realism.study:RealismStudy",
            "lsds_research.studies.realism.options:RealismOptions",
            summary="recordings and simulated clips side by side: motion, divergence, curl, lost dots",
        ),
        *(
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
        ),
    ]
