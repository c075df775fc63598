"""`lsds evaluate`: what models are worth on data that they have not seen, real recordings above all."""

from __future__ import annotations

import click

from lsds.cli.study_command import study_command
from lsds_research.incipient.options import IncipientOptions
from lsds_research.studies.models.options import ModelsOptions

MODELS = """Score models as they are on a dataset's objects that they have not learnt from. Nothing is trained.

DATA is a folder of lsds collect, or one in data/ of lsds reproduce. Needs the data extra.

\b
Examples:
  lsds evaluate models detection
  lsds evaluate models severity --model field-gru --model mine.onnx --plot speeds.png
  lsds evaluate models detection --job estimate --object book --json book.json
"""

INCIPIENT = """Separate recordings with slip from those without, on objects never trained on.

PATH holds index.csv (columns video, recording, object, camera, slip, and label_conflict if need be) and the videos
that it names. All models see clips of equal length, because a recording's length reveals its label. Offline figures
stand next to causal ones, and next to the rule of one number, the majority, shuffled labels and nuisances. A video that
cannot be read is reported and left out.

\b
Examples:
  lsds evaluate incipient-slip recordings/
  lsds evaluate incipient-slip recordings/ --plot roc.png --csv table.csv --json result.json
  lsds evaluate incipient-slip recordings/ --model detector.onnx --jobs 4
  lsds evaluate incipient-slip new-objects/ --train recordings/
"""


@click.group()
def evaluate() -> None:
    """Score models on data that they have not seen, next to rules that know nothing.

    The same as lsds study models and lsds study incipient-slip, but nothing is drawn unless --plot asks for it.

    \b
    Examples:
      lsds evaluate models detection/
      lsds evaluate incipient-slip recordings/
    """


evaluate.add_command(study_command("models", ModelsOptions, MODELS, positional=("data",), doing="scoring"))
evaluate.add_command(
    study_command("incipient-slip", IncipientOptions, INCIPIENT, positional=("path",), doing="reading, training")
)
