"""`lsds record export` on the command line."""

from __future__ import annotations

import json

import pytest

from lsds.cli.main import main

pytest.importorskip("pyarrow", reason="tables need the extra data")


def test_an_export_lists_what_it_wrote(recorded, tmp_path, capsys):
    out = tmp_path / "tables"
    assert main(["record", "export", str(recorded[0]), "--to", "parquet", "--out", str(out)]) == 0
    shown = capsys.readouterr()
    assert "/finger/finger/load" in shown.out
    assert f"exporting {recorded[0]}" in shown.err
    assert (out / "grip.parquet").exists()


def test_recordings_become_episodes(recorded, tmp_path, capsys):
    out, path = tmp_path / "dataset", str(recorded[0])
    command = ["record", "export", path, path, "--to", "lerobot", "--rate", "5", "--task", "hold", "--out", str(out)]
    assert main(command) == 0
    shown = capsys.readouterr()
    assert "exporting 2 recordings" in shown.err
    assert "frames" in shown.out
    info = json.loads((out / "meta" / "info.json").read_text())
    assert (info["total_episodes"], info["fps"]) == (2, 5)


def test_errors_are_one_line_with_a_remedy(recorded, tmp_path, capsys):
    path = str(recorded[0])
    assert main(["record", "export", path, "--to", "parquet", "--out", str(tmp_path)]) == 5
    assert "exists already, and an export overwrites nothing" in capsys.readouterr().err
    assert main(["record", "export", path, path, "--to", "ros2", "--out", str(tmp_path / "bag")]) == 2
    assert "takes one recording, not 2" in capsys.readouterr().err
    assert main(["record", "export", path, "--to", "parquet", "--rate", "5", "--out", str(tmp_path / "bag")]) == 2
    assert "--task and --rate are for --to lerobot" in capsys.readouterr().err
    other = tmp_path / "other.mcap"
    other.write_bytes(b"nothing")
    assert main(["record", "export", str(other), "--to", "ros2", "--out", str(tmp_path / "bag")]) == 5
    assert "not a recording of lsds" in capsys.readouterr().err


def test_help_has_examples_and_durations(capsys):
    assert main(["record", "export", "--help"]) == 0
    shown = capsys.readouterr().out
    assert "Examples:" in shown
    assert "Takes: 30 s per minute of one finger" in shown
