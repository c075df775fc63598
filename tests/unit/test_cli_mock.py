"""`lsds mock`: its flags, its completion, and its errors for unknown names."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from lsds.cli.main import main


def complete(words, index):
    """Return the completions that the shell receives."""
    environment = {**os.environ, "COMP_WORDS": words, "COMP_CWORD": str(index), "_LSDS_COMPLETE": "bash_complete"}
    done = subprocess.run(
        [Path(sys.executable).parent / "lsds"], capture_output=True, text=True, env=environment, check=False
    )
    assert done.stderr == ""
    return [line.partition(",")[2] for line in done.stdout.splitlines()]


def test_mocks_their_flags_and_their_choices_are_completed():
    assert {"hand-e", "ur5e", "gelsight-mini", "plant", "rig"} <= set(complete("lsds mock ", 2))
    assert complete("lsds mock hand", 2) == ["hand-e"]
    assert "--tcp-port" in complete("lsds mock hand-e --t", 3)
    assert complete("lsds mock ur5e --model ", 4) == ["ur3e", "ur5e", "ur10e", "ur16e"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["hand-f"], "No such command 'hand-f'. Did you mean 'hand-e'?"),
        (["hand-e", "--fault", "kind=dorp"], "'dorp' is not allowed (did you mean 'drop'?"),
        (["hand-e", "--fault", "kind=protective-stop"], "'protective-stop' is no fault of this mock"),
        (["ur5e", "--fault", "kind=drop,face=rtd"], "'drop' does not occur on a face 'rtd' (did you mean 'rtde'?)"),
        (["hand-e", "--fault", "drop"], "drop: is not KEY=VALUE (write kind=drop,probability=0.1)"),
        (["hand-e", "--stroke-mm", "wide"], "stroke_mm: should be a valid number"),
        (["hand-e", "--fault", "kind=drop,probabilty=0.1"], "unknown key (did you mean 'probability'?)"),
        (["hand-e", "--fault", "kind=gripper-fault"], "fault.code: is missing (value of the fault register, low"),
        (["ur5e", "--version", "5.19"], "version: String should match pattern"),
        (["ur5e", "--host", "198.51.100.1"], "is not an address of the loopback interface"),
    ],
)
def test_a_mock_that_cannot_be_served_is_one_clear_error(capsys, arguments, message):
    assert main(["mock", *arguments]) == 2
    printed = capsys.readouterr().err
    assert message in printed
    assert "Traceback" not in printed
