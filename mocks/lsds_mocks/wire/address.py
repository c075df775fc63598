"""Check of a mock's address: only addresses of the loopback interface are allowed."""

from __future__ import annotations

import fcntl
import ipaddress
import socket
import struct
from array import array

from lsds.errors import ConfigError, ConfigIssue

ACCEPT_QUEUE = 512
"""Connections that the system completes before a mock accepts them. When the queue is full, the system ignores further
ones, and their clients try again after one second (RFC 6298)."""

_SIOCGIFCONF = 0x8912
"""Request code of the `ioctl` that lists the network interfaces (linux/sockios.h)."""
_IFREQ_BYTES = 40
"""Bytes of a `struct ifreq` on 64-bit Linux."""


def is_loopback(address: str) -> bool:
    """Return whether an address (or "localhost") is in 127.0.0.0/8."""
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return address == "localhost"


def on_loopback(address: str) -> bool:
    """Return whether an address (or "localhost") belongs to this machine's loopback interface, aliases included."""
    if is_loopback(address):
        return True
    try:
        return str(ipaddress.ip_address(address)) in _loopback_aliases()
    except ValueError:
        return False


def require_loopback(mock: str, address: str, option: str = "host") -> None:
    """Raise ConfigError for any other address, because a mock has no protection against other machines."""
    if not on_loopback(address):
        problem = f"'{address}' is not an address of the loopback interface"
        raise ConfigError(mock, [ConfigIssue(option, problem, "use one of 127.0.0.0/8, for example 127.0.0.2")])


def _loopback_aliases() -> set[str]:
    """Return the additional addresses of the loopback interface."""
    size = 128 * _IFREQ_BYTES
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
            buffer = array("B", bytes(size))
            answer = fcntl.ioctl(link.fileno(), _SIOCGIFCONF, struct.pack("iL", size, buffer.buffer_info()[0]))
            used = struct.unpack("iL", answer)[0]
    except OSError:
        return set()
    found = set()
    for start in range(0, used, _IFREQ_BYTES):
        entry = buffer[start : start + _IFREQ_BYTES].tobytes()
        if entry[:16].split(b"\0")[0].split(b":")[0] == b"lo":
            found.add(socket.inet_ntoa(entry[20:24]))
    return found
