"""Open a serial port, with a remedy in the error if that fails."""

from __future__ import annotations

import contextlib
import errno
import os
from pathlib import Path
from typing import Any

from lsds.errors import ConnectFailed


def open_serial(device: str, port: str, baud: int, timeout_s: float) -> Any:
    """Return a `serial.Serial` (8N1) opened exclusively. Raises ConnectFailed."""
    import serial  # type: ignore[import-untyped]

    try:
        opened = serial.Serial(
            port, baud, timeout=timeout_s, write_timeout=timeout_s, inter_byte_timeout=None, exclusive=True
        )
    except (OSError, ValueError) as error:
        # SerialException is an OSError.
        raise _refusal(device, port, error) from error
    # USB adapters delay answers by up to 16 ms without low-latency mode; adapters that do not support it raise here.
    with contextlib.suppress(OSError, ValueError, NotImplementedError, AttributeError):
        opened.set_low_latency_mode(True)
    return opened


def _refusal(device: str, port: str, error: Exception) -> ConnectFailed:
    # Errors of termios have no errno.
    inner = error.__context__.args if error.__context__ is not None else ()
    number = getattr(error, "errno", None) or (inner[0] if inner else None)
    if number in (errno.ENOENT, errno.ENXIO, errno.ENODEV) or not os.path.lexists(port):
        return ConnectFailed(
            device, f"there is no port {port}", remedy="see `lsds devices`; is the adapter plugged in?"
        )
    if number in (errno.EACCES, errno.EPERM):
        group = _group(port)
        remedy = f"join its group: sudo usermod -aG {group} $USER, then log in again"
        return ConnectFailed(device, f"no permission for {port}", remedy=remedy)
    if number in (errno.EBUSY, errno.EAGAIN):
        return ConnectFailed(device, f"{port} is in use", remedy=f"end the program that has it: fuser -v {port}")
    if number in (errno.ENOTTY, errno.EINVAL, errno.EISDIR, errno.ENOTDIR):
        return ConnectFailed(device, f"{port} is not a serial port", remedy="see `lsds devices`")
    return ConnectFailed(device, f"cannot open {port}: {error}", remedy="see `lsds devices`")


def _group(port: str) -> str:
    """Return the name of the group that may use a port; on Debian and Ubuntu it is dialout."""
    try:
        group = Path(port).group()
    except (OSError, KeyError, NotImplementedError):
        return "dialout"
    return group if group not in ("root", "tty") else "dialout"
