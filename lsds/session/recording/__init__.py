"""Recordings: everything that a run took in and sent out, in one MCAP file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds.runtime.rig import Rig
    from lsds.session.recording.writer import Images, RecordingWriter

ENDING = ".mcap"
"""Ending of the files of recorded runs."""


def recorder_of(rig: Rig, path: str | Path | None, images: Images = "lossless") -> RecordingWriter | None:
    """Create the recording of a rig that is connected; None without a path. Raises DataError."""
    if path is None:
        return None
    # Imported here: a run without a recording needs none of it.
    from lsds.session.recording.header import RecordingHeader
    from lsds.session.recording.writer import RecordingWriter

    return RecordingWriter(Path(path), RecordingHeader.of(rig), images)
