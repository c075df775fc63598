"""The declaration of a backend by its plugin, and the context passed to the backend's factory.

A manifest module holds only hook implementations and `BackendSpec`s, so that listing plugins imports nothing heavy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from lsds.clock import Clock

T = TypeVar("T")

CONTRACT_VERSION = 2
"""Version of the contracts of this lsds; it grows when plugins have to be written in another way."""

OLDEST_CONTRACT_VERSION = 1
"""Oldest version of the contracts for which plugins still work."""


CELL = "lsds.cell"
"""Key of the rig's cell among its shared objects."""


@dataclass(frozen=True, slots=True)
class BackendSpec:
    """The declaration of one backend. `kind` is a key of `lsds.contracts.KINDS`.

    `factory` and `options` are "module:attribute" strings, imported when the backend is used: a callable
    `factory(options, context)` and a pydantic model of its options table (None if it takes none). `requires` are the
    import names it needs; `extra` is the pip extra that installs them. `group` names the command of lsds ("study",
    "learn") that a command is a part of; empty for one at the top. `hardware_verified` states on which hardware, and
    when, a person has tested it; empty if never. `virtual_time` marks a device that runs on the virtual clock (an
    in-process simulation, a recording); a rig of only such devices runs faster than real time. `in_cell` marks a device
    that is part of the rig's cell; without one no cell is built, so that no simulated truth enters the figures of a
    recording or of real hardware. `over_wire` marks a cell whose devices are reached from outside, over their wire
    protocols: it is built whenever a config names it. `contract` is the version of the contracts that the backend is
    written for; a plugin that needs another version than this lsds supports is refused when it is loaded.
    """

    kind: str
    name: str
    factory: str
    options: str | None = None
    summary: str = ""
    requires: tuple[str, ...] = ()
    extra: str = ""
    group: str = ""
    hardware_verified: str = ""
    virtual_time: bool = False
    in_cell: bool = False
    over_wire: bool = False
    contract: int = CONTRACT_VERSION


@dataclass(slots=True)
class BuildContext:
    """The context passed to a factory in addition to its options.

    `seed` is the seed of the run; derive streams from it with `rng_seed`, so that adding a device does not change the
    noise of another. `shared` returns one object per key for the whole rig. Device mocks share the rig's plant, see
    `lsds.contracts.plant.join`. `default_cell` builds the cell that they join if the rig names none, `wired_cell` the
    cell on the wire whose plant serves at an address, see `lsds.contracts.plant.attach`.
    """

    clock: Clock
    seed: int = 0
    default_cell: Callable[[BuildContext], Any] | None = None
    wired_cell: Callable[[BuildContext, str], Any] | None = None
    _shared: dict[str, Any] = field(default_factory=dict)

    def shared(self, key: str, make: Callable[[], T]) -> T:
        """Return the rig-wide object for `key`, created by `make` on the first call."""
        if key not in self._shared:
            self._shared[key] = make()
        value: T = self._shared[key]
        return value

    def cell(self) -> Any:
        """Return the rig's cell; the default cell if the rig names none; None if nothing can build one."""
        if CELL not in self._shared and self.default_cell is not None:
            self.install_cell(self.default_cell(self))
        return self._shared.get(CELL)

    def install_cell(self, cell: object) -> None:
        """Make a cell the one that devices find. Does nothing if there is one already."""
        self._shared.setdefault(CELL, cell)

    def rng_seed(self, stream: str) -> list[int]:
        """Return entropy for `numpy.random.default_rng`, the run's seed joined with a named stream."""
        return [self.seed, *stream.encode()]
