"""The real-time interface: it sends a package of 1220 bytes (since 5.10) in each cycle, and receives scripts."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from lsds_mocks.wire.ur.net import Link
from lsds_mocks.wire.ur.upload import Scripts, ScriptSession
from lsds_mocks.wire.ur.variables import joint_mode

if TYPE_CHECKING:
    from lsds_mocks.wire.ur.controller import Controller

_LAYOUT = struct.Struct(">i152d")
SIZE = _LAYOUT.size


class RealtimeFace:
    """All clients of the stream."""

    def __init__(self, controller: Controller, scripts: Scripts | None) -> None:
        self._controller = controller
        self._scripts = scripts
        self._links: list[Link] = []

    def open(self, link: Link) -> ScriptSession:
        """Take a new client."""
        self._links.append(link)
        return ScriptSession(self, link, self._controller, self._scripts)

    def forget(self, link: Link) -> None:
        """Let go of a client."""
        if link in self._links:
            self._links.remove(link)

    def publish(self) -> None:
        """Send the present cycle; clients that do not read, such as those that only upload, lose it."""
        if self._links:
            data = package(self._controller)
            for link in self._links:
                link.send(data, may_drop=True)


def package(c: Controller) -> bytes:
    """Return the present cycle's package."""
    zeros = (0.0,) * 6
    qd = [c.scaling * v for v in c.arm.qd]
    qdd = [c.scaling**2 * v for v in c.arm.qdd]
    return _LAYOUT.pack(
        SIZE,
        c.time_s,
        *c.arm.q,
        *qd,
        *qdd,
        *zeros,
        *zeros,
        *c.arm.q,
        *qd,
        *zeros,
        *zeros,
        *c.tcp_pose,
        *c.tcp_speed,
        *c.tcp_force,
        *c.tcp_pose,
        *c.tcp_speed,
        float(c.io.digital_in),
        *((28.0,) * 6),
        0.0,
        0.0,
        float(c.power.mode),
        *((float(joint_mode(c)),) * 6),
        float(c.safety),
        *zeros,
        *c.gravity,
        *zeros,
        c.scaling,
        0.0,
        0.0,
        0.0,
        48.0,
        48.0,
        0.6,
        *((48.0,) * 6),
        float(c.io.digital),
        float(c.runtime_state),
        *c.kinematics.frames(c.arm.q).points[2],
        0.0,
        0.0,
        0.0,
        float(c.safety),
        0.0,
        0.0,
        0.0,
        c.payload_kg,
        *c.payload_cog_m,
        *c.payload_inertia,
    )
