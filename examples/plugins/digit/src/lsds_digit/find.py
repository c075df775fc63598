"""Find the device file of a DIGIT by its serial number or its index."""

from __future__ import annotations

import os
import re
from pathlib import Path

from lsds.errors import ConnectFailed

from lsds_digit.modes import MODEL

BY_ID = Path("/dev/v4l/by-id")
"""Folder in which udev links each camera as usb-VENDOR_MODEL_SERIAL-video-indexN."""
_LINK = re.compile(rf"usb-.*_{MODEL}_(?P<serial>[^_]+)-video-index0")
"""Name of the link to the device file that captures. Index 1 and above carry metadata."""


def digits(folder: Path) -> dict[str, Path]:
    """Return the links of all connected DIGITs by serial number."""
    try:
        names = sorted(entry.name for entry in folder.iterdir())
    except OSError:
        return {}
    found = ((match["serial"], folder / name) for name in names if (match := _LINK.fullmatch(name)))
    return dict(found)


def device_file(device: str, serial: str, index: int | None, folder: Path) -> str:
    """Return the path of a DIGIT. Raises ConnectFailed, with the connected DIGITs, if none or several match."""
    path = f"/dev/video{index}" if index is not None else str(_by_serial(device, serial, folder))
    if not os.path.exists(path):
        raise ConnectFailed(device, f"there is no {path}", remedy=_connected(folder))
    if not os.access(path, os.R_OK | os.W_OK):
        remedy = "sudo usermod -aG video $USER, then log in again"
        raise ConnectFailed(device, f"no permission to open {path}", remedy=remedy)
    return path


def _by_serial(device: str, serial: str, folder: Path) -> Path:
    found = digits(folder)
    if serial and serial not in found:
        raise ConnectFailed(device, f"no DIGIT has the serial number {serial}", remedy=_connected(folder))
    if not found:
        raise ConnectFailed(device, "no DIGIT is connected", remedy=_connected(folder))
    if not serial and len(found) > 1:
        raise ConnectFailed(device, "several DIGITs are connected", remedy=f"set serial to one of {', '.join(found)}")
    return found[serial or next(iter(found))]


def _connected(folder: Path) -> str:
    found = ", ".join(digits(folder))
    return f"connected: {found}" if found else f"plug it in; {folder} lists no DIGIT"
