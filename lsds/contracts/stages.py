"""When each stage of a run began, for what depends on it: faults begin "at the lift", or when something first slips."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds.contracts import BuildContext

START = "start"
"""Name of the moment at which the run began."""
SLIP = "slip"
"""Name of the moment at which a slip was first detected while grip is corrected."""

NEVER = "never"
"""Name of a moment that never comes: a part with its fault at hand, for comparisons."""


class Stages:
    """The first time (ns) of each stage of a run, by the name that the job gives it; empty before the run."""

    def __init__(self) -> None:
        self._began: dict[str, int] = {}

    def enter(self, stage: str, now_ns: int) -> None:
        """Note that a stage is on."""
        self._began.setdefault(stage, now_ns)

    @property
    def names(self) -> tuple[str, ...]:
        """The stages that have begun, in their order."""
        return tuple(self._began)

    def began_ns(self, stage: str) -> int | None:
        """Return when a stage first began, None where it has not."""
        return self._began.get(stage)


def shared_stages(context: BuildContext) -> Stages:
    """Return the stages of the rig that a backend is built for."""
    return context.shared("stages", Stages)
