"""Open one device of a plugin, without a rig."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from lsds.clock import VirtualClock, WallClock
from lsds.contracts import BuildContext
from lsds.contracts.kinds import DEVICE_KINDS
from lsds.errors import PluginError
from lsds.registry.host import PluginHost

if TYPE_CHECKING:
    from lsds.contracts.kinds import Kind


@contextmanager
def open_device(kind: Kind, backend: str, **options: Any) -> Iterator[Any]:
    """Yield one device, connected; close it at the end. Its motion is stopped first.

    `options` are those of its config table: `lsds.open("gripper", "hand-e", port="/dev/ttyUSB0")`. Call `arm()` before
    commands. A simulated device gets a simulated cell and its virtual clock. Raises PluginError, ConfigError,
    DeviceError.
    """
    if kind not in DEVICE_KINDS:
        raise PluginError(f"'{kind}' is no kind of device (there are {', '.join(DEVICE_KINDS)})")
    host = PluginHost()
    virtual = host.find(kind, backend).spec.virtual_time
    device = host.build(kind, backend, options, BuildContext(VirtualClock() if virtual else WallClock(), 0))
    try:
        device.connect()
        yield device
    finally:
        try:
            device.stop()
        finally:
            device.close()
