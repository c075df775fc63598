"""Makes the factories of faults that the catalogue names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lsds_mocks.faults.catalogue import CATALOGUE
from lsds_mocks.faults.plan import Plan

if TYPE_CHECKING:
    from lsds.contracts import BuildContext
    from lsds_mocks.faults.plan import FaultOptions

_ENTRIES = {entry.factory: entry for entry in CATALOGUE}
_KINDS = {"camera": "sensor"}


@dataclass(frozen=True, slots=True)
class Made:
    """A `Fault`."""

    target: str
    plan: Plan
    wrapper: Callable[[Any, Plan], Any]
    malformed: bool = False

    @property
    def moment(self) -> str:
        """The stage of the run with which it begins."""
        return self.plan.moment

    def around(self, part: Any) -> Any:
        """Return the part with the fault."""
        return self.wrapper(part, self.plan)


def fault(wrapper: Callable[[Any, Plan], Any], factory: str) -> Callable[[FaultOptions, BuildContext], Made]:
    """Return the factory of the fault that the catalogue lists under `factory`; `wrapper` puts it around a part."""
    entry = _ENTRIES[factory]

    def make(options: FaultOptions, context: BuildContext) -> Made:
        target = _KINDS.get(entry.target, entry.target)
        return Made(target, Plan(entry.name, entry.levels, options, context), wrapper, entry.malformed)

    return make
