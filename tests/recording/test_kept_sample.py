"""A recording of an earlier version is read as before: `data/format_1.mcap`, half a second of a simulated lift."""

from __future__ import annotations

from pathlib import Path

import pytest

from lsds.contracts.events import Corrected, FramesRead, GripperRead, JobStepped, PosesRead, TruthKnown
from lsds.session.recording.files import contents
from lsds.session.recording.header import FORMAT
from lsds.session.recording.reader import Recording

DATA = Path(__file__).parent / "data"
FIRST = DATA / "format_1.mcap"


def test_every_stream_is_read():
    found = contents(FIRST)
    assert found["damage"] == ""
    assert (found["lsds"], found["simulated"], found["fingers"]) == ("0.1.0", True, ["finger"])
    messages = {name: own["messages"] for name, own in found["topics"].items()}
    assert messages["/cycle"] == messages["/finger/finger/image"] == messages["/grip"] == 13
    assert (messages["/gripper/state"], messages["/arm/state"], messages["/truth"]) == (51, 51, 63)


def test_every_event_is_a_value_of_the_present_contracts():
    events = list(Recording(FIRST).events())
    kinds = {
        kind: [event for event in events if isinstance(event, kind)]
        for kind in (FramesRead, GripperRead, JobStepped, Corrected, PosesRead, TruthKnown)
    }
    assert {kind.__name__: len(found) for kind, found in kinds.items()} == {
        "FramesRead": 13,
        "GripperRead": 51,
        "JobStepped": 4,
        "Corrected": 4,
        "PosesRead": 30,
        "TruthKnown": 63,
    }
    frame = kinds[FramesRead][0].frames[0][1]
    assert frame.image.shape == (240, 320, 3)
    assert kinds[GripperRead][0].state.aperture_m == pytest.approx(0.0235, abs=0.002)
    assert set(kinds[PosesRead][0].sample.poses) == {"gripper", "object"}
    assert {event.wanted.stage for event in kinds[JobStepped]} == {"take up"}


def test_the_header_names_what_a_replay_needs():
    header = Recording(FIRST).header
    assert header.format == 1
    assert header.gripper.stroke_m == pytest.approx(0.05)
    assert header.arm is not None
    assert 'backend = "mock-hand-e"' in header.config


def test_every_format_has_a_sample():
    assert {int(path.stem.split("_")[1]) for path in DATA.glob("format_*.mcap")} == set(range(1, FORMAT + 1))
