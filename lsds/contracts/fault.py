"""Contract of a fault: what goes wrong with one part of a rig, on purpose, to see what the rest does about it."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

OBSERVER = "observer"
"""Target of a fault that is one more observer, which fails."""


@runtime_checkable
class Fault(Protocol):
    """A fault of a rig's part, named by `[[faults]]` in a config. Deterministic by the run's seed."""

    @property
    def target(self) -> str:
        """The kind of the part that it afflicts (a key of `KINDS`), or "observer"."""
        ...

    @property
    def moment(self) -> str:
        """The stage of the run with which it begins, "start" for that of the run."""
        ...

    def around(self, part: Any) -> Any:
        """Return the part with the fault, of the same contract; until the fault begins it does what the part does.

        For the target "observer", `part` is None and what is returned is called with every cycle.
        """
        ...
