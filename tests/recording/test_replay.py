"""A replay gives the same answers bit by bit; a change shows where it changes something."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from lsds.cli.main import main
from lsds.contracts import Detection, Twist, Wanted
from lsds.contracts.events import Corrected, JobStepped
from lsds.errors import ConfigError, DataError
from lsds.session.recording.files import cut
from lsds.session.recording.reader import Recording
from lsds.session.recording.writer import RecordingWriter
from lsds.session.replay import replay
from lsds.session.run import run
from tests.recording.conftest import SHORT


def test_a_replay_is_identical_bit_by_bit(recorded):
    path, session = recorded
    result = replay(path)
    assert result.identical
    assert result.cycles == session.summary["cycles"]
    assert (result.problem, result.damage) == ("", "")
    assert result.streams["/grip"].compared == result.cycles
    assert result.streams["/correction"].compared > 0


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


def test_a_replay_that_breaks_off_is_not_identical(recorded, tmp_path, capsys):
    from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

    path, _ = recorded
    broken = tmp_path / "broken.mcap"
    source = Recording(path)
    copy = RecordingWriter(broken, source.header)
    for number, message in enumerate(source.messages()):
        data = message.data
        if message.topic == "/finger/finger/image" and number > 2000:
            data = CompressedImage(data=b"no image", format="png").SerializeToString()
        copy.copy(message._replace(data=data), source.schemas[message.schema])
    copy.close()
    result = replay(broken)
    assert "image is damaged" in result.problem
    assert not result.complete
    assert not result.identical
    assert main(["replay", str(broken)]) == 13
    assert "not to the end" in capsys.readouterr().out


def test_corrections_are_compared_at_their_times(recorded):
    path, _ = recorded
    stream = replay(path, "controller.backend=pd").streams["/correction"]
    own = {event.now_ns for event in Recording(path).events() if isinstance(event, Corrected)}
    assert stream.compared + stream.only_recorded == len(own)


class Silent:
    """A detector that abstains."""

    def reset(self):
        pass

    def update(self, observation):
        return Detection(None, float("nan"), 0.5, 0.0)


def test_a_detector_that_was_an_object_is_given_again(tmp_path):
    path = tmp_path / "run.mcap"
    run(None, SHORT, record=path, detector=Silent())
    with pytest.raises(DataError, match="its detector was an object of the program"):
        replay(path)
    assert replay(path, detector=Silent()).identical
    assert not replay(path, "detector.backend=imprint").identical


def test_a_job_whose_twist_is_an_array_is_recorded(tmp_path):
    class Up:
        def begin(self, setting):
            self.end_ns = setting.t_ns + 400_000_000

        def step(self, now):
            return Wanted("up", twist=Twist(np.array([0, 0, 0.01]), (0.0, 0.0, 0.0)), done=now.t_ns > self.end_ns)

    session = run(None, ["seed=5"], job=Up(), record=tmp_path / "run.mcap")
    assert session.fault is None
    wanted = [event.wanted for event in Recording(tmp_path / "run.mcap").events() if isinstance(event, JobStepped)]
    assert wanted[0].twist == Twist((0.0, 0.0, 0.01), (0.0, 0.0, 0.0))


@pytest.mark.parametrize("asked", ["auto", "portable"])
def test_a_recording_keeps_the_arithmetic_that_was_used(tmp_path, asked):
    pytest.importorskip("numba")
    path = tmp_path / "run.mcap"
    run(None, [*SHORT, f"tactile.arithmetic={asked}"], record=path)
    used = tomllib.loads(Recording(path).header.config)["tactile"]["arithmetic"]
    assert used == ("portable" if asked == "portable" else "compiled")
    assert replay(path).identical
