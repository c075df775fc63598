"""The events of a run of two fingers, kept in a file and fed to a recording again and again, without end."""

from __future__ import annotations

import pickle
from dataclasses import replace
from itertools import count

import lsds
from lsds.contracts import Cycle
from lsds.contracts.events import FramesRead
from lsds.session.recording.header import RecordingHeader
from tests.recording.conftest import SHORT, TWO_FINGERS


def keep_lap(path):
    """Run the simulated cell with two fingers once, and keep its events and the header of its recording."""
    events = []
    with lsds.bring_up(None, [*SHORT, *TWO_FINGERS]) as engine:
        header = RecordingHeader.of(engine.rig)
        engine.events.add("lap", events.append)
        engine.run()
    path.write_bytes(pickle.dumps((header, [without_imprint(event) for event in events])))


def load_lap(path):
    """Return the header and the events of a lap."""
    return pickle.loads(path.read_bytes())


def laps(events):
    """Yield the events without end; each lap follows the one before, in time and in the numbers of its frames."""
    begin, end = time_of(events[0]), time_of(events[-1])
    lap_ns = end - begin + 10_000_000
    frames = 1 + max(frame.seq for event in events if isinstance(event, FramesRead) for _, frame in event.frames)
    for lap in count():
        for event in events:
            yield shifted(event, lap * lap_ns, lap * frames)


def time_of(event):
    """Return the rig's clock at an event (ns)."""
    return event.t_ns if isinstance(event, Cycle) else event.now_ns


def shifted(event, by_ns, frames):
    """Return the event at a later time."""
    if isinstance(event, Cycle):
        fingers = tuple(replace(own, frame=later(own.frame, by_ns, frames)) for own in event.fingers)
        return replace(event, t_ns=event.t_ns + by_ns, fingers=fingers)
    if isinstance(event, FramesRead):
        own = tuple((name, later(frame, by_ns, frames)) for name, frame in event.frames)
        return replace(event, now_ns=event.now_ns + by_ns, frames=own)
    return replace(event, now_ns=event.now_ns + by_ns)


def later(frame, by_ns, frames):
    return replace(frame, t_ns=frame.t_ns + by_ns, seq=frame.seq + frames)


def without_imprint(event):
    """Return the event without what an algorithm computes on demand: that holds the algorithm itself."""
    if not isinstance(event, Cycle):
        return event
    fingers = tuple(replace(own, observation=replace(own.observation, imprint=None)) for own in event.fingers)
    return replace(event, fingers=fingers)
