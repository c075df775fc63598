"""`lsds evaluate`: score models on unseen data, such as real recordings."""

from __future__ import annotations

import click

from lsds.cli.study_command import study_command
from lsds_research.incipient.options import IncipientOptions
from lsds_research.search.risk_options import RiskOptions
from lsds_research.slips.options import SlipOptions
from lsds_research.studies.faults.options import FaultsOptions
from lsds_research.studies.grip.options import GripOptions
from lsds_research.studies.models.options import ModelsOptions

MODELS = """Score finished models on held-out objects.

Scores are over the objects of a dataset that the models were not trained on. Nothing is trained. DATA is a folder
written by lsds collect, or a folder in data/ of lsds reproduce. Needs the data extra.

\b
Examples:
  lsds evaluate models detection
  lsds evaluate models severity --model field-gru --model mine.onnx --plot speeds.png
  lsds evaluate models detection --job estimate --object book --json book.json
"""

INCIPIENT = """Classify real recordings as slip or no slip.

Models are trained on some objects and tested on others. PATH holds index.csv (columns video, recording, object, camera,
slip, and optionally label_conflict) and the videos that it names. All models get clips of equal length, because the
length of a recording reveals its label. The table compares offline with causal models and both with controls: a
threshold on one feature, the majority class, shuffled labels and nuisance controls. A video that cannot be read is
reported and left out.

\b
Examples:
  lsds evaluate incipient-slip recordings/
  lsds evaluate incipient-slip recordings/ --plot roc.png --csv table.csv --json result.json
  lsds evaluate incipient-slip recordings/ --model detector.onnx --jobs 4
  lsds evaluate incipient-slip new-objects/ --train recordings/
"""


SLIP = """Score detectors and estimators frame by frame on real recordings labelled by eye.

PATH holds recordings, videos or folders of images, anywhere below it, and slip_labels.csv (lsds label); for the public
incipient-slip set the labels are shipped. Every installed detector and estimator runs on every frame. The tables list,
for each setup, the share of slip frames found and of slips noticed at their onset, false alarms per 100 moving and per
100 still frames, and the error of travel and turn over a slip. The learner 'fused' is also fitted without the scored
object, and on the other setup. Needs the data extra; fitting needs the train extra.

\b
Examples:
  lsds evaluate slip recordings/
  lsds evaluate slip recordings/ --plot curves.png --csv table.csv --json result.json
  lsds evaluate slip recordings/ --detector imprint --detector monotone --objects all
"""


@click.group()
def evaluate() -> None:
    """Score models on unseen data and compare them with trivial baselines.

    The same as lsds study models and lsds study incipient-slip, but a picture is drawn only with --plot.

    \b
    Examples:
      lsds evaluate models detection/
      lsds evaluate incipient-slip recordings/
    """


evaluate.add_command(study_command("models", ModelsOptions, MODELS, positional=("data",), doing="scoring"))
evaluate.add_command(study_command("slip", SlipOptions, SLIP, positional=("path",), doing="reading"))
evaluate.add_command(study_command("grip", GripOptions, GripOptions.__doc__ or "", doing="lifting"))
evaluate.add_command(study_command("faults", FaultsOptions, FaultsOptions.__doc__ or "", doing="lifting"))
evaluate.add_command(study_command("risk", RiskOptions, RiskOptions.__doc__ or "", doing="running"))
evaluate.add_command(
    study_command("incipient-slip", IncipientOptions, INCIPIENT, positional=("path",), doing="reading, training")
)
