"""What a plugin declares about a backend, and what a backend's factory is given.

A manifest module holds hook implementations and `BackendSpec`s only, so that listing plugins imports nothing heavy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeVar

if TYPE_CHECKING:
    from lsds.clock import Clock

Kind = Literal[
    "sensor",
    "gripper",
    "arm",
    "pose_source",
    "cell",
    "tracker",
    "detector",
    "estimator",
    "controller",
    "wire_mock",
    "study",
    "learner",
    "command",
]
CONFIG_KINDS: tuple[Kind, ...] = (
    "sensor",
    "gripper",
    "arm",
    "pose_source",
    "cell",
    "tracker",
    "detector",
    "estimator",
    "controller",
)
"""Kinds that have a section in a rig's config."""

KINDS: tuple[Kind, ...] = (*CONFIG_KINDS, "wire_mock", "study", "learner", "command")
"""All kinds. A `wire_mock` is a server that speaks a device's protocol; `lsds mock` runs it. A `study` measures
something; `lsds study` runs it. A `learner` fits a detector or an estimator; `lsds train` runs it. A `command` is a
command of `lsds`: its factory names a `click.Command`, which is not called to build one."""

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class BackendSpec:
    """One backend on offer.

    `factory` and `options` are "module:attribute" strings, imported when the backend is used: a callable
    `factory(options, context)` and a pydantic model of its options table (None where it takes none). `requires` are
    import names that must be there; `extra` is the pip extra that brings them. `hardware_verified` says on what
    hardware, and when, a person has seen it work; empty for never. `virtual_time` marks a device that runs on the
    virtual clock (an in-process simulation, a recording); a rig of only such devices runs faster than real time.
    `in_cell` marks a device that lives in the rig's cell; without any, no cell is built, so that no simulated truth
    finds its way into the figures of a recording or of real hardware. `over_wire` marks a cell whose devices are
    reached from outside, over their own protocols: it is built wherever a config names it.
    """

    kind: Kind
    name: str
    factory: str
    options: str | None = None
    summary: str = ""
    requires: tuple[str, ...] = ()
    extra: str = ""
    hardware_verified: str = ""
    virtual_time: bool = False
    in_cell: bool = False
    over_wire: bool = False


@dataclass(slots=True)
class BuildContext:
    """What a factory is given beside its own options.

    `seed` is the run's; derive streams from it with `rng_seed`, so that adding a device does not change another's
    noise. `shared` hands out one object per key for the whole rig: it is how mocks meet in one plant.
    """

    clock: Clock
    seed: int = 0
    _shared: dict[str, Any] = field(default_factory=dict)

    def shared(self, key: str, make: Callable[[], T]) -> T:
        """Return the rig-wide object for `key`, made by `make` the first time."""
        if key not in self._shared:
            self._shared[key] = make()
        value: T = self._shared[key]
        return value

    def rng_seed(self, stream: str) -> list[int]:
        """Return entropy for `numpy.random.default_rng`, the run's seed joined with a named stream."""
        return [self.seed, *stream.encode()]
