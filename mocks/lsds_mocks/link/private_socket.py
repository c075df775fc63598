"""Local sockets that only this user's processes share: their folder, and a check of the peer's user."""

from __future__ import annotations

import contextlib
import os
import socket
import stat
import struct
import tempfile
from collections.abc import Iterator
from pathlib import Path

from lsds.errors import ConnectFailed

_PLANT = "shared plant"
_CREDENTIALS = struct.Struct("3i")
"""Process, user and group of a peer: `struct ucred`, see unix(7)."""


def runtime_folder() -> Path:
    """Return the folder of this user's sockets, which may not exist yet: in `XDG_RUNTIME_DIR` if that is private."""
    given = Path(os.environ.get("XDG_RUNTIME_DIR", ""))
    if given.is_absolute() and _is_private(given):
        return given / "lsds"
    return Path(tempfile.gettempdir()) / f"lsds-{os.getuid()}"


def make_private(folder: Path) -> None:
    """Create a folder that only this user can enter. Raises ConnectFailed if that fails or others can enter it."""
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
    except OSError as error:
        remedy = "choose another path: cell.wire.socket"
        raise ConnectFailed(_PLANT, f"cannot create '{folder}': {error.strerror}", remedy=remedy) from error
    if not _is_private(folder):
        problem = f"'{folder}' is not a folder that only you can enter"
        raise ConnectFailed(_PLANT, problem, remedy="remove it, or choose another path: cell.wire.socket")


def _is_private(folder: Path) -> bool:
    try:
        found = folder.lstat()
    except OSError:
        return False
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o077


@contextlib.contextmanager
def owner_only() -> Iterator[None]:
    """Restrict access to files and sockets created in the body to this user, from the moment of their creation.

    It changes the file mode mask of the whole process meanwhile.
    """
    before = os.umask(0o177)
    try:
        yield
    finally:
        os.umask(before)


def same_user(link: socket.socket) -> bool:
    """Return whether the process at the other end of a connected Unix socket runs as this user."""
    data = link.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    return bool(_CREDENTIALS.unpack(data)[1] == os.getuid())
