"""The process-wide state that a plugin must leave as it is: random generators, error state, logging, environment."""

from __future__ import annotations

import logging
import os
import random
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

KIT_SEED = 0x5EED
"""Seed of the kit, which no plugin uses, so that a plugin's seeding shows even if the caller uses the same seed."""


@dataclass(frozen=True)
class Changes:
    """Changes of the process by a call: names of state, and threads that were started."""

    state: tuple[str, ...]
    threads: tuple[threading.Thread, ...]


def changes_by(run: Callable[[], object]) -> Changes:
    """Return the changes by a second call of `run`; the first one may import libraries. All state is restored."""
    with _known_state():
        run()
    with _known_state():
        before, threads = global_state(), set(threading.enumerate())
        run()
        after, started = global_state(), set(threading.enumerate()) - threads
    return Changes(tuple(what for what in before if before[what] != after[what]), tuple(started))


def global_state() -> dict[str, Any]:
    """Return the process-wide state by its name."""
    name, keys, *rest = np.random.get_state(legacy=True)  # noqa: NPY002 - this is what must not change
    root = logging.getLogger()
    return {
        "numpy's global random state": (name, np.asarray(keys).tobytes(), *rest),
        "numpy's error state": (np.geterr(), np.geterrcall()),
        "the state of random": random.getstate(),
        "the level of the root logger": root.level,
        "the handlers of the root logger": tuple(root.handlers),
        "the filters of the root logger": tuple(root.filters),
        "the level below which logging is disabled": root.manager.disable,
        "the working directory": os.getcwd(),
        "the environment": dict(os.environ),
    }


@contextmanager
def kept_state() -> Iterator[None]:
    """Restore all of `global_state` afterwards."""
    numpy_state, state, folder = np.random.get_state(), random.getstate(), os.getcwd()  # noqa: NPY002
    environment = dict(os.environ)
    with np.errstate(), _kept_logging():
        try:
            yield
        finally:
            np.random.set_state(numpy_state)  # noqa: NPY002
            random.setstate(state)
            os.chdir(folder)
            os.environ.clear()
            os.environ.update(environment)


@contextmanager
def global_seed(seed: int) -> Iterator[None]:
    """Seed the global random generators, and restore them afterwards."""
    with kept_state():
        np.random.seed(seed)  # noqa: NPY002
        random.seed(seed)
        yield


@contextmanager
def _known_state() -> Iterator[None]:
    """Start from a seed of the kit, numpy's default error state and a root logger without handlers.

    Otherwise a change to a value that the process already has would not be detected.
    """
    with global_seed(KIT_SEED), np.errstate(divide="warn", over="warn", under="ignore", invalid="warn"):
        root = logging.getLogger()
        # Handlers are taken off the list, not removed: a plugin that configures logging by force would close them.
        root.handlers = []
        yield


@contextmanager
def _kept_logging() -> Iterator[None]:
    root = logging.getLogger()
    level, handlers, filters, disabled = root.level, root.handlers, root.filters, root.manager.disable
    kept_handlers, kept_filters = list(handlers), list(filters)
    try:
        yield
    finally:
        added = [handler for handler in root.handlers if handler not in kept_handlers]
        root.handlers, root.filters = handlers, filters
        root.handlers[:], root.filters[:] = kept_handlers, kept_filters
        root.setLevel(level)
        logging.disable(disabled)
        for handler in added:
            handler.close()  # It may have opened a file.
