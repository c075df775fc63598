"""A model in the running cell: a frame goes in, the model's numbers come out. Shared by detectors and estimators."""

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
        """Load. Raises ModelError, as `lsds.models.artefact.load` does, and for signals that no frame tells."""
        artefact = load(path, job)
        self.card = artefact.card
        try:
            self._pick = Picker(self.card.signals)
        except DataError as error:
            raise ModelError(f"{path}: cannot run in a cell: {error}") from error
        self._window = Window(self.card.length, len(self.card.signals))
        self._run = artefact.bind(self._window)

    def reset(self) -> None:
        """Forget the past frames."""
        self._window.reset()

    def update(self, observation: Observation) -> list[float] | None:
        """Return the model's numbers for the present frame and the past, None where it lacks one of its signals.

        Such a frame enters no window. Raises DataError for a frame of other features than this version's.
        """
        picked = self._pick(observation)
        if picked is None:
            return None
        self._window.push(picked)
        return self._run()
