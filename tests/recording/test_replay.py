"""A replay gives the same answers bit by bit; a change shows where it changes something."""

from __future__ import annotations

import pytest

from lsds.errors import ConfigError, DataError
from lsds.session.recording.files import cut
from lsds.session.replay import replay
from lsds.session.run import run
from tests.recording.conftest import SHORT

TWO_FINGERS = [
    "sensors.left.backend=mock-gelsight-mini",
    "sensors.right.backend=mock-gelsight-mini",
    "sensors.right.mock-gelsight-mini.gel=4",
]


def test_a_replay_is_identical_bit_by_bit(recorded):
    path, session = recorded
    result = replay(path)
    assert result.identical
    assert result.cycles == session.summary["cycles"]
    assert (result.problem, result.damage) == ("", "")
    assert result.streams["/grip"].compared == result.cycles
    assert result.streams["/correction"].compared > 0


@pytest.mark.parametrize(
    "overrides",
    [
        [*SHORT, *TWO_FINGERS],
        [*SHORT, "task.grasp=touch", "seed=8"],
        [*SHORT, "controller.backend=pd", "detector.backend=imprint", "estimator.backend=field", "seed=2"],
        [*SHORT, "pose_source.backend=mock-truth-camera", "cell.simulated.object=book"],
        [*SHORT, "controller.enabled=false"],
    ],
    ids=["two fingers", "by touch", "pd", "poses", "no controller"],
)
def test_other_rigs_replay_identically(tmp_path, overrides):
    path = tmp_path / "run.mcap"
    session = run(None, overrides, record=path)
    result = replay(path)
    different = {name: stream for name, stream in result.streams.items() if not stream.identical}
    assert not different
    assert result.cycles == session.summary["cycles"]


def test_a_run_that_ended_in_a_fault_replays_to_there(tmp_path):
    path = tmp_path / "run.mcap"
    faults = '[{backend="camera-gone", at="lift"}]'
    session = run(None, [*SHORT, f"faults={faults}"], record=path)
    assert session.fault is not None
    assert replay(path).identical


def test_another_detector_shows_where_it_answers_otherwise(recorded):
    path, _ = recorded
    result = replay(path, "detector.backend=imprint")
    assert not result.identical
    assert result.streams["/detection"].different == result.cycles
    assert result.streams["/finger/finger/tracks"].identical
    assert result.streams["/detection"].first_s >= 0


def test_another_controller_has_no_effect_on_what_happened(recorded):
    path, _ = recorded
    result = replay(path, ["controller.backend=pd"])
    assert not result.streams["/correction"].identical
    assert result.streams["/finger/finger/tracks"].identical
    held = [row["held_m"] for row in result.recorded if row["topic"] == "/cycle"]
    assert held == [row["held_m"] for row in result.replayed if row["topic"] == "/cycle"]


def test_a_recording_that_begins_late_is_not_identical(recorded, tmp_path):
    path, _ = recorded
    late = tmp_path / "late.mcap"
    cut(path, late, 2.0)
    result = replay(late)
    assert not result.identical


def test_overrides_that_cannot_be_used_are_refused(recorded, tmp_path):
    path, _ = recorded
    with pytest.raises(ConfigError, match="no-such"):
        replay(path, "detector.backend=no-such")
    with pytest.raises(DataError, match="cannot be read"):
        replay(tmp_path / "none.mcap")


def test_jpeg_is_smaller_and_not_exact(tmp_path, recorded):
    path = tmp_path / "run.mcap"
    run(None, SHORT, record=path, images="jpeg")
    assert path.stat().st_size < 0.4 * recorded[0].stat().st_size
    assert not replay(path).identical
