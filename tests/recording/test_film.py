"""`lsds record film` keeps a sensor's frames, and moves nothing."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from lsds.cli.main import cli
from lsds.session.film import film
from lsds.session.recording.reader import Recording
from lsds.session.track import track


def test_a_film_has_the_frames_of_its_time_and_no_device(tmp_path):
    path = tmp_path / "gel.mcap"
    session = film(None, ["seed=3"], 2.0, path)
    assert session.fault is None
    recording = Recording(path)
    assert (recording.header.gripper, recording.header.arm) == (None, None)
    frames = list(recording.frames())
    assert len(frames) == pytest.approx(50, abs=4)
    result = track(path)
    assert result.error is None
    assert len(result.t_s) > 40


def test_the_command_states_what_it_wrote(tmp_path):
    path = tmp_path / "gel.mcap"
    found = CliRunner().invoke(cli, ["record", "film", "--seconds", "1", "--out", str(path)])
    assert found.exit_code == 0, found.output
    assert f"{path}: " in found.output
    again = CliRunner().invoke(cli, ["record", "film", "--seconds", "1", "--out", str(path)])
    assert again.exit_code != 0
    assert "exists already" in str(again.exception)
