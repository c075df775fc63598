"""Contracts of the per-frame algorithms: tracker, detector, estimator, controller.

They are deterministic: no I/O, no clock, no randomness without a seed. State is explicit, and `reset` clears all of it.
Frames fed one by one and frames of a recording give the same numbers.
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from lsds.contracts.grip import GripEstimate, GripTask
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
    """Finds the reference's markers in each frame."""

    def start(self, frame: Frame, pad: tuple[int, int] | None = None) -> MarkerReference:
        """Take the undeformed frame as the reference and reset all other state.

        `pad` is (rows, columns) of printed markers, if known. Raises DataError if no markers are found.
        """
        ...

    def update(self, frame: Frame) -> MarkerTracks:
        """Track the markers into the next frame. Never raises because of image content: markers not found are
        flagged."""
        ...

    def reset(self) -> None:
        """Clear the motion history, keep the reference."""
        ...


@runtime_checkable
class Detector(Protocol):
    """Detects whether the object slips."""

    def update(self, observation: Observation) -> Detection:
        """Decide on the present frame and the past."""
        ...

    def reset(self) -> None:
        """Forget the past."""
        ...


@runtime_checkable
class Estimator(Protocol):
    """Estimates the slip velocity of the object."""

    def update(self, observation: Observation) -> SlipEstimate:
        """Estimate from the present frame and the past."""
        ...

    def reset(self) -> None:
        """Forget the past."""
        ...


@runtime_checkable
class Controller(Protocol):
    """Computes an aperture from the estimate of the grip.

    The guard lets automatic corrections only close, unless the controller has a true `may_open`: its options let it
    open on purpose (a release). `limits_force` is true if it keeps the normal force below `GripTask.fragile_n`;
    otherwise a rig whose task gives `fragile_n` does not come up. Such a controller may have an attribute `held_back`,
    true if `fragile_n` limited the last update, which a run names as the reason of a drop.

    Both attributes are read once, when a run begins. Where one is missing it is taken to be false.
    """

    @property
    def may_open(self) -> bool:
        """Whether it may ask for a larger aperture."""
        ...

    @property
    def limits_force(self) -> bool:
        """Whether it respects `GripTask.fragile_n`."""
        ...

    def update(self, grip: GripEstimate, wanted: GripTask) -> float | None:
        """Return the aperture (m) to command, or None to leave the gripper as it is."""
        ...

    def reset(self) -> None:
        """Forget the past."""
        ...
