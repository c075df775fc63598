"""Contract of a fault: what goes wrong with one part of a rig, on purpose, to see what the rest does about it."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

OBSERVER = "observer"
"""Target of a fault that is one more observer, which fails."""


@runtime_checkable
class Fault(Protocol):
    """A fault of a rig's part, named by `[[faults]]` in a config. Deterministic by the run's seed.

    A fault with an option `severity` takes 1 (hardly noticed) to 5 (the worst). Answers keep their type, and arrays
    their shape and type; errors are LsdsErrors. A fault that breaks this on purpose declares it with an attribute
    `malformed`, true. `lsds.contracts.stages.shared_stages(context)` holds the stages that have begun.
    """

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
