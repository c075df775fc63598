"""The sensor `video` keeps the contract of every sensor, given a recording."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from lsds.testing import conformance
from tests.tactile.render import pad_positions, render
from tests.video_files import write_video

_DOTS = pad_positions()
_FOLDER = tempfile.TemporaryDirectory(prefix="lsds-video-")
_FRAMES = [render(_DOTS + np.array([0.2 * i, 0.0]), seed=i) for i in range(10)] * 12
CLIP = write_video(Path(_FOLDER.name) / "clip.avi", _FRAMES)


@conformance("sensor", "video", options={"path": str(CLIP)})
def test_video(check):
    check()
