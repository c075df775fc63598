"""Commands under their names of the release before: they print the present one and do nothing."""

from __future__ import annotations

import pytest

from lsds.cli.main import COMMANDS, FORMER, main


@pytest.mark.parametrize("name", FORMER)
def test_a_former_name_prints_the_present_one(capsys, name):
    assert main([name, "--help"]) == 2
    assert f"'lsds {name}' is now 'lsds {FORMER[name]}'" in capsys.readouterr().err


@pytest.mark.parametrize("name", FORMER)
def test_the_present_name_is_a_command(capsys, name):
    for present in FORMER[name].replace("lsds ", "").split("' or '"):
        assert main([*present.split(), "--help"]) == 0
        assert "Examples:" in capsys.readouterr().out
    assert name not in COMMANDS


def test_a_config_is_checked_without_connecting(tmp_path, capsys):
    rig = tmp_path / "rig.toml"
    rig.write_text(
        '[gripper]\nbackend = "hand-e"\n[gripper.hand-e]\nport = "/dev/none"\n[sensor]\nbackend = "uvc-tactile"\n'
    )
    assert main(["config", "check", str(rig)]) == 0
    out = capsys.readouterr().out
    assert "valid" in out
    assert "hand-e" in out
    rig.write_text('[gripper]\nbackend = "hand"\n[task]\nlift_speed = 1\n')
    assert main(["config", "check", str(rig)]) == 2
    err = capsys.readouterr().err
    assert "gripper.backend" in err
    assert "task.lift_speed" in err
