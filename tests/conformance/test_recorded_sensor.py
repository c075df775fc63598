"""The sensors that play something stored keep the contract of every sensor, given a file."""

from __future__ import annotations

import importlib.util
import tempfile
from pathlib import Path

import numpy as np

from lsds.session.track import track
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


if importlib.util.find_spec("mcap"):
    RUN = Path(_FOLDER.name) / "run.mcap"
    track(CLIP, record=RUN)

    @conformance("sensor", "recording", options={"path": str(RUN)})
    def test_recording(check):
        check()
