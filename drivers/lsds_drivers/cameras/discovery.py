"""Find a camera by index, path, or part of its stable udev name."""

from __future__ import annotations

import os
import re
from pathlib import Path

from lsds.errors import ConnectFailed

BY_ID = Path("/dev/v4l/by-id")
_CAPTURES = "video-index0"
"""UVC cameras have a second device node for metadata; the first one captures."""


def cameras(folder: Path = BY_ID) -> list[Path]:
    """Return the stable links of all cameras that capture, sorted."""
    try:
        entries = sorted(folder.iterdir())
    except OSError:
        return []
    first = [entry for entry in entries if entry.name.endswith(_CAPTURES)]
    return first or entries


def find_camera(device: str, wanted: str, folder: Path = BY_ID) -> str:
    """Return the path of the camera that `wanted` names: "2", "/dev/video2", or a part of its name such as "GelSight".

    Raises ConnectFailed, listing the available cameras, if none or several match, or if it must not be opened.
    """
    if re.fullmatch(r"\d+", wanted):
        path = f"/dev/video{wanted}"
    elif wanted.startswith("/"):
        path = wanted
    else:
        path = _by_name(device, wanted, folder)
    if not os.path.exists(path):
        raise ConnectFailed(device, f"there is no {path}", remedy=there_is(folder))
    if not os.access(path, os.R_OK | os.W_OK):
        raise ConnectFailed(
            device, f"{path} may not be opened", remedy="sudo usermod -aG video $USER, then log in again"
        )
    return path


def there_is(folder: Path = BY_ID) -> str:
    """Return a sentence that lists the connected cameras."""
    found = cameras(folder)
    if not found:
        return f"{folder} holds no camera: plug it in, and give it to the container if this is one"
    return "there are: " + ", ".join(entry.name for entry in found)


def _by_name(device: str, wanted: str, folder: Path) -> str:
    def plain(text: str) -> str:
        return re.sub(r"[\W_]+", "", text).lower()

    fitting = [entry for entry in cameras(folder) if plain(wanted) in plain(entry.name)]
    if not fitting:
        raise ConnectFailed(device, f"no camera's name holds '{wanted}'", remedy=there_is(folder))
    if len(fitting) > 1:
        names = ", ".join(entry.name for entry in fitting)
        raise ConnectFailed(device, f"several cameras' names hold '{wanted}'", remedy=f"name one of: {names}")
    return str(fitting[0])
