"""Tab offers keys, names and values: by the function that click calls, and in bash itself."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest
from click.shell_completion import ShellComplete

from lsds.cli.main import cli, main

pytestmark = pytest.mark.usefixtures("installed_host")


def offered(*words):
    """Return what is offered for the last word, after those before it."""
    *before, incomplete = words
    completion = ShellComplete(cli, {}, "lsds", "_LSDS_COMPLETE")
    return [item.value for item in completion.get_completions(list(before), incomplete)]


@pytest.mark.parametrize(
    ("typed", "found"),
    [
        ("", {"seed=", "task.", "gripper.", "cell."}),
        ("gri", {"grip.", "gripper."}),
        ("gripper.", {"gripper.backend=", "gripper.mock-hand-e.", "gripper.hand-e."}),
        ("gripper.mock-hand-e.lat", {"gripper.mock-hand-e.latency_ms="}),
        ("task.lift_sp", {"task.lift_speed_m_s="}),
        ("cell.wire.pl", {"cell.wire.plant."}),
    ],
)
def test_set_completes_keys_table_by_table(typed, found):
    assert found <= set(offered("run", "--set", typed))
    assert all(value.startswith(typed) for value in offered("run", "--set", typed))


def test_set_completes_backends_and_other_values_that_a_key_lists():
    assert offered("run", "--set", "detector.backend=fus") == ["detector.backend=fused"]
    assert "gripper.backend=mock-hand-e" in offered("run", "--set", "gripper.backend=")
    assert "gripper.backend=none" in offered("run", "--set", "gripper.backend=")
    assert offered("run", "--set", "controller.enabled=") == ["controller.enabled=true", "controller.enabled=false"]
    assert offered("run", "--set", "cell.simulated.fidelity=wi") == ["cell.simulated.fidelity=winkler"]
    assert offered("run", "--set", "task.lift_s=") == []
    assert offered("run", "--set", "nothing.like.this") == []


@pytest.mark.parametrize(
    "command", ["track", "replay", "record film", "config check", "calibrate slip", "calibrate grip", "mock rig"]
)
def test_every_command_that_sets_config_keys_completes_them(command):
    assert "detector.backend=fused" in offered(*command.split(), "--set", "detector.backend=")


def test_collect_completes_keys_and_objects():
    assert offered("learn", "collect", "--set", "seed") == ["seed="]
    assert offered("learn", "collect", "--object", "mar") == ["marble", "marker-pen"]


def test_a_fault_is_completed_with_its_severity_and_moment():
    assert "camera-noise" in offered("run", "--fault", "camera-n")
    assert offered("run", "--fault", "camera-noise:") == [f"camera-noise:{number}" for number in range(1, 6)]
    assert {"camera-noise:5@start", "camera-noise:5@slip", "camera-noise:5@lift"} <= set(
        offered("run", "--fault", "camera-noise:5@")
    )
    assert "camera-noise" in offered("study", "faults", "--fault", "camera-n")


def test_objects_learners_and_algorithms_are_completed():
    assert offered("study", "grip", "--object", "bo") == ["book", "bottle"]
    assert "cell.simulated.object=book" in offered("run", "--set", "cell.simulated.object=bo")
    assert "field-mlp" in offered("learn", "train", "field")
    assert "field-mlp" in offered("study", "learning", "--learner", "field")
    assert "belief" in offered("study", "grip", "--controller", "bel")
    assert offered("track", "--tracker", "cen") == ["centroid"]


def test_set_of_a_study_completes_its_options():
    assert offered("study", "gel", "--set", "rep") == ["repeats="]


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
@pytest.mark.parametrize(
    ("line", "replies", "nospace"),
    [
        ("lsds run --set detector.ba", ["detector.backend="], True),
        ("lsds run --set detector.backend=fu", ["fused"], False),
        ("lsds run --set=detector.backend=fu", ["fused"], False),
        ("lsds run --fault camera-noise:5@sl", ["slip"], False),
        ("lsds run --fault camera-noise:", ["1", "2", "3", "4", "5"], False),
        ("lsds compl", ["completion"], False),
        ("lsds study grip --object ", None, False),
    ],
)
def test_bash_replaces_the_part_of_a_word_that_it_cuts(line, replies, nospace, tmp_path, capsys):
    assert main(["completion", "bash"]) == 0
    (tmp_path / "script").write_text(capsys.readouterr().out, encoding="utf-8")
    program = tmp_path / "lsds"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m lsds "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    # Outside a completion compopt fails; what it is asked for is noted instead.
    driver = (
        'source "$1"; compopt() { echo "compopt $*"; }; '
        'COMP_LINE="$2"; COMP_POINT=${#2}; _lsds_completion lsds; printf "%s\\n" "${COMPREPLY[@]}"'
    )
    environment = {**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    environment["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    done = subprocess.run(
        ["bash", "--norc", "-c", driver, "bash", str(tmp_path / "script"), line],
        capture_output=True,
        text=True,
        env=environment,
        check=True,
    )
    printed = done.stdout.splitlines()
    found = [text for text in printed if not text.startswith("compopt")]
    assert done.stderr == ""
    assert ("compopt -o nospace" in printed) == nospace
    if replies is None:
        assert {"book", "marble"} <= set(found)
    else:
        assert found == replies


def test_a_script_of_an_earlier_release_still_completes(monkeypatch, capsys):
    monkeypatch.setenv("_LSDS_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", "lsds\ncompl")
    monkeypatch.setenv("COMP_CWORD", "1")
    with pytest.raises(SystemExit):
        main([])
    assert capsys.readouterr().out == "plain,completion\n"
