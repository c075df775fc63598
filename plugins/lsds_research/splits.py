"""Splits into training and test data: the paper's splits, which leak, and those by recording and by object.

Frames of one recording are similar. If some of them are in the training data, a model that recognises the recording
scores as well as one that detects slip.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from lsds.errors import DataError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_research.datasets import Dataset

SplitName = Literal["frames", "recording", "object"]


def folds(
    groups: NDArray[Any], stratify: NDArray[Any], count: int, seed: int
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Yield `count` times rows to train on and rows to test on; no group is in both.

    Each fold gets about the same number of rows of each value of `stratify` (rows,). Groups (rows,) are assigned
    largest first, ties in an order drawn from the seed. With one group per row this is stratified random
    cross-validation.

    Raises DataError for fewer groups than folds.
    """
    names, own = np.unique(groups, return_inverse=True)
    if len(names) < count:
        raise DataError(f"{count} folds need as many groups, there are {len(names)}: {', '.join(map(str, names[:5]))}")
    values, value = np.unique(stratify, return_inverse=True)
    table = np.zeros((len(names), len(values)))
    np.add.at(table, (own, value), 1)
    whole = np.maximum(table.sum(axis=0), 1)
    shuffled = np.random.default_rng(seed).permutation(len(names))
    order = shuffled[np.argsort(-table[shuffled].sum(axis=1), kind="stable")]
    held = np.zeros((count, len(values)))
    fold_of = np.zeros(len(names), np.intp)
    for group in order:
        # The fold that ends up farthest below its share of what this group holds.
        load = ((held + table[group]) / whole).max(axis=1) + 1e-9 * (held / whole).sum(axis=1)
        fold_of[group] = int(np.argmin(load))
        held[fold_of[group]] += table[group]
    for fold in range(count):
        inside = fold_of[own] == fold
        yield np.flatnonzero(~inside), np.flatnonzero(inside)


def random_folds(stratify: NDArray[Any], count: int, seed: int) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Yield the paper's split: stratified over frames at random. Leaks; shown for parity only."""
    rng = np.random.default_rng(seed)
    fold_of = np.zeros(len(stratify), np.intp)
    for value in np.unique(stratify):
        rows = rng.permutation(np.flatnonzero(stratify == value))
        fold_of[rows] = np.arange(len(rows)) % count
    for fold in range(count):
        yield np.flatnonzero(fold_of != fold), np.flatnonzero(fold_of == fold)


def each_and_all(objects: NDArray[Any]) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Yield each object's name with a mask (rows,) of its rows, in order of appearance; last "all" with all rows."""
    for name in dict.fromkeys(objects.tolist()):
        yield str(name), objects == name
    yield "all", np.ones(len(objects), bool)


def seen_and_unseen(data: Dataset, unseen: Sequence[str], name: object = "the dataset") -> tuple[Dataset, Dataset]:
    """Return the training objects, and the held-out objects. Raises DataError, with the name, if one is empty."""
    held = np.isin(data["object"], unseen)
    if not held.any() or held.all():
        raise DataError(f"{name}: needs objects to learn from and some of {', '.join(unseen)}")
    return data.where(~held), data.where(held)


def leave_one_out(groups: NDArray[Any]) -> Iterator[tuple[str, NDArray[np.intp], NDArray[np.intp]]]:
    """Yield each group's name with the rows of all others and its own."""
    for name in np.unique(groups):
        yield str(name), np.flatnonzero(groups != name), np.flatnonzero(groups == name)
