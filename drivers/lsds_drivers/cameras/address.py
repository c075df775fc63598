"""Make a source from the option `camera`."""

from __future__ import annotations

import re
import stat
from pathlib import Path

from lsds_drivers.cameras.source import FrameSource, Reduction, whole

VIDEO_FILES = (".avi", ".mp4", ".mkv", ".mov", ".mjpeg", ".mjpg", ".m4v", ".webm")


def make_source(
    device: str, camera: str, reduction: Reduction = whole, *, size: tuple[int, int] | None = None
) -> FrameSource:
    """Return the source that `camera` names; opens nothing.

    "2", "/dev/video2" or a part of a name such as "GelSight": V4L2. "http://...": an MJPEG stream. "rtsp://..." and
    other schemes: FFmpeg. "realsense", "realsense:SERIAL" or "realsense:FILE.db3": a RealSense. A named pipe: JPEG
    after JPEG. A video file: played at its own pace.
    """
    if re.match(r"https?://", camera):
        from lsds_drivers.cameras.http import HttpSource

        return HttpSource(device, camera, reduction)
    if camera == "realsense" or camera.startswith("realsense:"):
        from lsds_drivers.realsense.source import RealSenseSource

        return RealSenseSource(device, camera.partition(":")[2], size=size)
    if _is_pipe(camera):
        from lsds_drivers.cameras.pipe import PipeSource

        return PipeSource(device, camera, reduction)
    if "://" in camera or camera.lower().endswith(VIDEO_FILES):
        from lsds_drivers.cameras.opencv import OpenCvSource

        return OpenCvSource(device, camera)
    from lsds_drivers.cameras.v4l2 import V4l2Source

    return V4l2Source(device, camera, reduction, size=size)


def _is_pipe(camera: str) -> bool:
    try:
        return "/" in camera and stat.S_ISFIFO(Path(camera).expanduser().stat().st_mode)
    except OSError:
        return False
