"""Identification of a program's sender; the program may connect to the ports on which the sender's process listens."""

from __future__ import annotations

import contextlib
import os
import socket
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

Address = tuple[str, int]

_LISTENING = "0A"
"""State of a listening socket in the kernel's table."""


class Sender(NamedTuple):
    """The TCP connection that delivered a program: the sender's address and the mock's."""

    peer: Address
    own: Address


class _Socket(NamedTuple):
    local: Address
    remote: Address
    state: str
    inode: int


def sender_of(link: socket.socket) -> Sender | None:
    """Return the sender behind a connected socket; None if it has disconnected."""
    try:
        return Sender(link.getpeername()[:2], link.getsockname()[:2])
    except OSError:
        return None


def listening_ports(sender: Sender) -> frozenset[int]:
    """Return the TCP ports on which the sender's process listens now.

    The result is empty if the process has ended or the system has no `/proc`.
    """
    sockets = list(_sockets())
    inodes = {s.inode for s in sockets if s.local == sender.peer and s.remote == sender.own and s.inode}
    if not inodes:
        return frozenset()
    listening = {s.inode: s.local[1] for s in sockets if s.state == _LISTENING}
    found: set[int] = set()
    for owned in _inodes_by_process():
        if owned & inodes:
            found |= {listening[inode] for inode in owned & listening.keys()}
    return frozenset(found)


def _sockets() -> Iterator[_Socket]:
    """Yield the sockets of the kernel's tables, see proc_net_tcp(5); those of IPv6 by their mapped IPv4 address."""
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        try:
            lines = Path(table).read_text("ascii").splitlines()[1:]
        except OSError:
            continue
        for line in lines:
            words = line.split()
            yield _Socket(_address(words[1]), _address(words[2]), words[3], int(words[9]))


def _address(text: str) -> Address:
    """Convert "0100007F:1F90": native 32-bit numbers, of which the last one is the IPv4 address of a mapped one."""
    host, _, port = text.partition(":")
    return socket.inet_ntoa(struct.pack("=I", int(host[-8:], 16))), int(port, 16)


def _inodes_by_process() -> Iterator[set[int]]:
    """Yield the inodes of the sockets of each process whose files this user may list."""
    for process in Path("/proc").glob("[0-9]*"):
        try:
            files = os.listdir(process / "fd")
        except OSError:
            # The process has ended, or belongs to another user.
            continue
        found: set[int] = set()
        for file in files:
            with contextlib.suppress(OSError):
                target = os.readlink(process / "fd" / file)
                if target.startswith("socket:["):
                    found.add(int(target[8:-1]))
        if found:
            yield found
