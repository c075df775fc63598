"""The interface between a tactile camera mock and its gel. Times are the rig's monotonic nanoseconds."""

from __future__ import annotations

from typing import Protocol

from lsds_mocks.gel.protocol import GelModel
from lsds_mocks.gel.state import GelState


class GelLink(Protocol):
    """The link of a tactile camera mock to its gel."""

    @property
    def gel(self) -> GelModel:
        """The gel model that renders the states."""
        ...

    def at(self, t_ns: int) -> GelState | None:
        """Return the gel's state at a past instant; None if it is not available yet or any more."""
        ...

    def close(self) -> None:
        """Give the link back."""
        ...
