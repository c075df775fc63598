"""The dataset that a study's `--data` names, split into training and held-out objects."""

from __future__ import annotations

from pathlib import Path

from lsds.errors import DataError
from lsds_research.collecting.objects import UNSEEN
from lsds_research.datasets import Dataset, load
from lsds_research.splits import seen_and_unseen


def split_dataset(folder: str) -> tuple[Dataset, Dataset]:
    """Return both parts. Raises DataError without a folder, or if it holds no dataset or lacks a part."""
    if not folder:
        raise DataError("name a dataset with --data: lsds learn collect makes one, or data/ of lsds study reproduce")
    return seen_and_unseen(load(Path(folder)), UNSEEN, folder)
