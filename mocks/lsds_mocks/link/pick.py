"""Which link a wire face gets: none where it is alone, one to the shared plant where it is given its address."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lsds.errors import ConfigError, ConfigIssue

if TYPE_CHECKING:
    from lsds.clock import Clock
    from lsds_mocks.link.protocols import ArmLink


def arm_link(cell: str, clock: Clock) -> ArmLink | None:
    """Return the link of an arm's face to the plant at an address. Raises ConnectFailed where nobody is there."""
    if not cell:
        return None
    raise ConfigError("mock arm", [ConfigIssue("cell", f"no shared plant at '{cell}'")])
