"""What this package offers to lsds: no driver has been written yet, and none is pretended."""

from __future__ import annotations

from lsds.contracts import BackendSpec
from lsds.plugins import hookimpl


@hookimpl
def lsds_backends() -> list[BackendSpec]:
    """Return the drivers of real hardware."""
    return []
