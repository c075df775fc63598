"""Twenty kinds of recorded runs, each replayed bit by bit: `pytest -m slow -s tests/recording/test_twenty_runs.py`."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from lsds.session.recording.reader import Recording
from lsds.session.replay import replay
from lsds.session.run import run
from lsds.session.track import track
from tests.recording.conftest import SHORT, TWO_FINGERS
from tests.tactile.render import pad_positions, render
from tests.video_files import write_video

VIDEOS = 5


def simulated(path, *changes):
    return run(None, [*SHORT, *changes], record=path).summary["cycles"]


def ended_by_a_fault(path):
    session = run(None, [*SHORT, 'faults=[{backend="camera-gone", at="lift"}]'], record=path)
    assert session.fault is not None
    return session.summary["cycles"]


def over_the_wire(path):
    from tests.wire.test_wire_rig import RIG, overrides

    return run(RIG, [*overrides(path.parent), "seed=4"], record=path).summary["cycles"]


def tracked(path, source):
    result = track(source, record=path)
    assert result.error is None
    return len(result.t_s)


def rendered_video(path):
    marks = pad_positions()
    frames = [render(marks + np.array([0.4, 0.2]) * step, noise=1.0, seed=step) for step in range(20)]
    return tracked(path, write_video(path.parent / "clip.avi", frames))


def real_video(path, number):
    videos = sorted((Path(os.environ["LSDS_DATA"]) / "incipient_slip" / "videos").glob("*.avi"))
    return tracked(path, videos[number * len(videos) // VIDEOS])


def of_cell(*changes):
    return lambda path: simulated(path, *changes)


USUAL = {
    "two fingers": of_cell(*TWO_FINGERS),
    "by touch": of_cell("task.grasp=touch", "seed=8"),
    "pd, imprint, field": of_cell(
        "controller.backend=pd", "detector.backend=imprint", "estimator.backend=field", "seed=2"
    ),
    "poses": of_cell("pose_source.backend=mock-truth-camera", "cell.simulated.object=book"),
    "no controller": of_cell("controller.enabled=false"),
    "fault": ended_by_a_fault,
}
OTHERS = {
    "one finger": of_cell(),
    "another object": of_cell("cell.simulated.object=sponge", "seed=3"),
    "slide": of_cell("job.backend=slide", "job.slide.slide_s=0.6", "job.slide.hold_s=0.2"),
    "camera noise": of_cell("sensor.mock-gelsight-mini.noise=3", "sensor.mock-gelsight-mini.drop_probability=0.1"),
    "centroid tracker": of_cell("tracker.backend=centroid", "cell.simulated.object=ruler"),
    "dense tracker, no markers": of_cell("tracker.backend=dis", "sensor.mock-gelsight-mini.pad=none"),
    "probe before the lift": of_cell("task.probe=true", "seed=6"),
    "wire rig": over_the_wire,
    "rendered video": rendered_video,
}
REAL = {f"real video {number + 1}": partial(real_video, number=number) for number in range(VIDEOS)}


def replayed(make, folder):
    """Make a recording and replay it; return its events and cycles, and whether the answers are the same."""
    path = folder / "run.mcap"
    cycles = make(path)
    result = replay(path)
    assert result.cycles == cycles > 0
    assert (result.problem, result.damage) == ("", "")
    different = sorted(name for name, stream in result.streams.items() if not stream.identical)
    return sum(1 for _ in Recording(path).events()), cycles, different, result.identical


@pytest.mark.parametrize("kind", USUAL)
def test_a_kind_of_run_replays_identically(tmp_path, kind):
    _, _, different, identical = replayed(USUAL[kind], tmp_path)
    assert not different
    assert identical


@pytest.mark.slow
def test_twenty_kinds_of_runs_replay_identically(tmp_path):
    for module in ("rtde_control", "pymodbus"):
        pytest.importorskip(module, reason="the wire rig needs the extra hardware")
    if not os.environ.get("LSDS_DATA"):
        pytest.skip("needs the real recordings (LSDS_DATA)")
    kinds = USUAL | OTHERS | REAL
    assert len(kinds) == 20
    print(f"\n{'kind':28} {'events':>7} {'cycles':>7}  identical")
    failed = []
    for number, (kind, make) in enumerate(kinds.items()):
        folder = tmp_path / str(number)
        folder.mkdir()
        events, cycles, different, identical = replayed(make, folder)
        print(f"{kind:28} {events:7} {cycles:7}  {'yes' if identical else 'no: ' + ', '.join(different)}")
        if not identical:
            failed.append(kind)
    assert not failed
