"""Schedule and severity of a fault."""

from __future__ import annotations

import math
from itertools import count
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict, Field

from lsds.clock import nanoseconds, seconds
from lsds.contracts.stages import START, shared_stages

if TYPE_CHECKING:
    import numpy as np

    from lsds.contracts import BuildContext


class FaultOptions(BaseModel):
    """Options of every fault of the catalogue, keys of a table of `[[faults]]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    severity: int = Field(default=3, ge=1, le=5, description="1 is hardly seen, 5 the worst; some faults have no scale")
    at: str = Field(
        default=START,
        description="a stage of the job ('lift', 'hold', ...), 'start', 'slip' (the first alarm), or 'never'",
    )
    after_s: float = Field(default=0.0, ge=0, le=3600, description="delay after that moment")
    for_s: float | None = Field(default=None, gt=0, le=3600, description="duration; default: to the end")


class Plan:
    """Decides when a fault is on. `level` is the value of its severity, 1 for a fault without a scale."""

    def __init__(self, name: str, levels: tuple[float, ...], options: FaultOptions, context: BuildContext) -> None:
        self.name = name
        self.level = levels[options.severity - 1] if levels else 1.0
        self._options = options
        self.clock = context.clock
        self._stages = shared_stages(context)
        # Two faults of the same name must not share one stream of random numbers.
        number = next(context.shared(f"faults {name}", count))
        self._entropy = context.rng_seed(f"fault {name}" + (f" {number}" if number else ""))
        self._rng: np.random.Generator | None = None

    @property
    def moment(self) -> str:
        """The stage of the run with which the fault begins."""
        return self._options.at

    @property
    def rng(self) -> np.random.Generator:
        """The fault's own stream of random numbers."""
        if self._rng is None:
            import numpy as np

            self._rng = np.random.default_rng(self._entropy)
        return self._rng

    def restart(self) -> None:
        """Restart the stream of random numbers."""
        self._rng = None

    @property
    def since_s(self) -> float:
        """Time since the fault began (s); NaN while it is off."""
        began_ns = self._stages.began_ns(self._options.at)
        if began_ns is None:
            return math.nan
        since_ns = self.clock.now() - began_ns - nanoseconds(self._options.after_s)
        over = self._options.for_s is not None and since_ns >= nanoseconds(self._options.for_s)
        return math.nan if since_ns < 0 or over else seconds(since_ns)

    @property
    def on(self) -> bool:
        """Whether the fault is on now."""
        return not math.isnan(self.since_s)

    def happens(self) -> bool:
        """Whether the fault strikes this time; its level is the probability."""
        return self.on and bool(self.rng.random() < self.level)


class Around:
    """A part of a rig with a fault around it; attributes that the fault does not define are those of the part."""

    def __init__(self, part: Any, plan: Plan) -> None:
        self._part, self._plan = part, plan

    def __getattr__(self, name: str) -> Any:
        return getattr(self._part, name)
