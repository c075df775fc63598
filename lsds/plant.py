"""Join the simulated cell of a rig: how a device mock, of any distribution, finds the plant that it shares."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lsds.contracts.plant import Plant
from lsds.errors import ConfigError, ConfigIssue

if TYPE_CHECKING:
    from lsds.contracts.backend import BuildContext


def join(context: BuildContext) -> Plant:
    """Return the plant of the rig's cell, or of the default cell if the rig names none. Call it in a device's factory.

    Declare the device with `BackendSpec(in_cell=True, virtual_time=True)`. Raises ConfigError if there is no cell, or
    if its plant is not in this process; PluginError if the default cell cannot be built.
    """
    cell = context.cell()
    if isinstance(cell, Plant):
        return cell
    problem = f"{type(cell).__name__} has no plant in this process" if cell is not None else "there is no cell"
    remedy = 'choose one that device mocks can join: [cell] backend = "simulated"'
    raise ConfigError("rig", [ConfigIssue("cell.backend", f"a device joins the simulated cell, and {problem}", remedy)])
