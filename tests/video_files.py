"""Small recordings for tests, lossless so that what was rendered is what is read."""

from __future__ import annotations

from pathlib import Path

import cv2


def write_video(path: Path, frames, rate_hz: float = 25.0, codec: str = "FFV1") -> Path:
    """Write RGB frames as a video."""
    height, width = frames[0].shape[:2]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), rate_hz, (width, height))
    assert writer.isOpened()
    for frame in frames:
        writer.write(cv2.cvtColor(frame, cv2.COLOR_RGB2BGR))
    writer.release()
    return path
