"""Inference of a model in the running cell, frame by frame. Shared by detectors and estimators."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lsds.errors import DataError, ModelError
from lsds.models.artefact import load
from lsds.models.signals import Picker
from lsds.models.window import Window

if TYPE_CHECKING:
    from lsds.contracts import Observation


class RunningModel:
    """One model, its card and its window of past frames."""

    def __init__(self, path: Path, job: str) -> None:
        """Load the model. Raises ModelError as `lsds.models.artefact.load` does, and for signals not available in a
        frame."""
        artefact = load(path, job)
        self.card = artefact.card
        try:
            self._pick = Picker(self.card.signals)
        except DataError as error:
            raise ModelError(f"{path}: cannot run in a cell: {error}") from error
        self._window = Window(self.card.length, len(self.card.signals))
        self._run = artefact.bind(self._window)

    def reset(self) -> None:
        """Clear the past frames."""
        self._window.reset()

    def update(self, observation: Observation) -> list[float] | None:
        """Return the model's output for the present frame and the past, None if a signal is undefined.

        Such a frame is not added to the window. Raises DataError for a frame with features of another version.
        """
        picked = self._pick(observation)
        if picked is None:
            return None
        self._window.push(picked)
        return self._run()
