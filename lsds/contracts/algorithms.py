"""Contracts of the per-frame algorithms: tracker, detector, estimator, controller.

They are pure in the sense that counts: no I/O, no clock, no randomness that is not seeded; state is explicit and
`reset` forgets all of it. Feeding frames one by one and feeding a recording give the same numbers.
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from lsds.contracts.cycle import GripInput
from lsds.contracts.values import (
    Detection,
    Frame,
    MarkerReference,
    MarkerTracks,
    Observation,
    SlipEstimate,
)


@runtime_checkable
class Tracker(Protocol):
    """Finds the reference's dots in each frame."""

    def start(self, frame: Frame, pad: tuple[int, int] | None = None) -> MarkerReference:
        """Take the undeformed frame as reference and forget all else.

        `pad` is (rows, columns) of dots as printed, where known. Raises DataError where no dots are found.
        """
        ...

    def update(self, frame: Frame) -> MarkerTracks:
        """Follow the dots into the next frame. Never raises for what an image shows: what is not found is flagged."""
        ...

    def reset(self) -> None:
        """Forget motion history, keep the reference."""
        ...


@runtime_checkable
class Detector(Protocol):
    """Tells whether the object slips."""

    def update(self, observation: Observation) -> Detection:
        """Decide on the present frame and the past."""
        ...

    def reset(self) -> None:
        """Forget the past."""
        ...


@runtime_checkable
class Estimator(Protocol):
    """Tells how fast the object slips."""

    def update(self, observation: Observation) -> SlipEstimate:
        """Estimate from the present frame and the past."""
        ...

    def reset(self) -> None:
        """Forget the past."""
        ...


@runtime_checkable
class Controller(Protocol):
    """Turns the slip state into an aperture.

    The guard lets automatic corrections only close. A controller that opens on purpose (a release) says so with an
    attribute `may_open`, true where its options ever open; without it, it may not.
    """

    def update(self, state: GripInput) -> float | None:
        """Return the aperture (m) to command, or None to leave the gripper as it is."""
        ...

    def reset(self) -> None:
        """Forget the past."""
        ...
