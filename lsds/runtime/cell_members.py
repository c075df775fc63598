"""The devices of a rig that are part of the simulated cell: which combinations are valid, and who knows its truth.

No other module of the runtime distinguishes simulated from real devices.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from lsds.contracts.kinds import KINDS
from lsds.errors import ConfigError, ConfigIssue

if TYPE_CHECKING:
    from lsds.registry.backends import Backend
    from lsds.registry.host import PluginHost


class CellMembers:
    """The chosen cell of a rig, and its devices."""

    def __init__(self, cell: Backend | None, devices: Sequence[Backend]) -> None:
        self._cell = cell.spec if cell is not None else None
        self._devices = [device.spec for device in devices]

    @property
    def over_wire(self) -> bool:
        """Whether the cell serves its devices in other processes, over their wire protocols."""
        return self._cell is not None and self._cell.over_wire

    @property
    def need_cell(self) -> bool:
        """Whether a cell is to be built; without a simulated device none is, so that no truth enters the figures."""
        return self.over_wire or any(device.in_cell for device in self._devices)

    @property
    def are_sensed(self) -> bool:
        """Whether the sensors feel the cell, so that its truth is that of the run."""
        return self.over_wire or any(device.in_cell for device in self._devices if device.kind == "sensor")

    def require_compatible(self, host: PluginHost) -> None:
        """Raise ConfigError for devices that cannot be part of one cell."""
        self._require_one_cell()
        self._require_felt(host)

    def _require_one_cell(self) -> None:
        """Refuse a cell on the wire together with devices that live in a cell of this process."""
        inside = [device.name for device in self._devices if device.in_cell]
        if self._cell is not None and self.over_wire and inside:
            problem = (
                f"'{self._cell.name}' is reached over the wire, but {', '.join(inside)} would live in another cell"
            )
            raise ConfigError("rig", [ConfigIssue("cell.backend", problem, "choose drivers for these devices")])

    def _require_felt(self, host: PluginHost) -> None:
        """Refuse a gripper or an arm outside of the cell that a sensor is in: the sensor would never feel it."""
        sensor = next((device for device in self._devices if device.kind == "sensor" and device.in_cell), None)
        if sensor is None:
            return
        issues = []
        for device in self._devices:
            if device.kind in ("gripper", "arm") and not device.in_cell:
                mocks = [b.spec.name for b in host.backends if b.spec.kind == device.kind and b.spec.in_cell]
                names = "', '".join(mocks) or KINDS[device.kind].default
                problem = (
                    f"{device.kind} '{device.name}' is not part of the simulated cell that sensor '{sensor.name}' is in"
                )
                remedy = (
                    f"choose '{names}', or a sensor outside the cell; "
                    "a mock joins with lsds.contracts.plant.join and in_cell=True"
                )
                issues.append(ConfigIssue(f"{device.kind}.backend", problem, remedy))
        if issues:
            raise ConfigError("rig", issues)
