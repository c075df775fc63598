"""What the detector `fused` learns from beside real frames: simulated recordings, thinned out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds_research.collecting.objects import SEEN
from lsds_research.make_models import OWN

if TYPE_CHECKING:
    from lsds_research.datasets import Dataset


def learnt_from(data: Dataset) -> Dataset:
    """Return the recordings of a simulated dataset that `fused` learns from: those of the training objects."""
    seen = data.where(np.isin(data["object"], SEEN))
    if not len(seen):
        seen = data
    every = OWN["fused"].get(str(data.card.get("job")), 1)
    return seen.where(np.isin(seen["recording"], np.unique(seen["recording"])[::every]))
