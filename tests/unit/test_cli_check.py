"""`lsds check KIND:NAME`: results, exit codes, and what was skipped."""

from __future__ import annotations

import json
import sys

import click
import pytest
from fake_cell import FakeGripper, fake_host, plugin
from installed import installed_host

from lsds.cli import check as module
from lsds.cli.main import main
from lsds.contracts import BackendSpec
from lsds.registry import PluginHost


@pytest.fixture(autouse=True)
def _fakes(monkeypatch):
    monkeypatch.setattr(module, "host_of", lambda ctx: fake_host())


def test_all_checks_of_a_sound_device_pass(capsys):
    assert main(["check", "gripper:fake-gripper"]) == 0
    printed = capsys.readouterr()
    assert "gripper_never_opens_on_failure" in printed.out
    assert " passed" in printed.out
    assert "unplug checks skipped" in printed.out
    assert "checking gripper 'fake-gripper'" in printed.err


def test_a_failed_check_shows_values_rule_and_guide(capsys, monkeypatch):
    monkeypatch.setattr(FakeGripper, "command", lambda self, command: command)
    assert main(["check", "gripper:fake-gripper", "--only", "refuses_before_arm", "--only", "spec_is_sound"]) == 1
    out = capsys.readouterr().out
    assert "refuses_before_arm failed: command() before arm() did not raise LifecycleError" in out
    assert "rule: A device that is connected but not armed refuses commands." in out
    assert "guide: docs/plugins.md#grippers" in out
    assert "1 passed, 1 failed" in out


def test_a_cause_of_several_failures_is_printed_once(capsys, monkeypatch):
    def lost(self):
        raise OSError("no route to host")

    monkeypatch.setattr(FakeGripper, "connect", lost)
    only = [part for name in ("refuses_before_arm", "spec_is_sound") for part in ("--only", name)]
    assert main(["check", "gripper:fake-gripper", *only]) == 1
    out = capsys.readouterr().out
    assert out.count("OSError: no route to host") == 1
    assert "2 failed" in out


def test_an_assertion_without_a_message_names_its_place(capsys, monkeypatch):
    def silent(self):
        raise AssertionError

    monkeypatch.setattr(FakeGripper, "connect", silent)
    assert main(["check", "gripper:fake-gripper", "--only", "refuses_before_arm"]) == 1
    assert f"AssertionError without a message at {__file__}" in capsys.readouterr().out


def test_checks_that_move_a_real_device_are_listed_with_what_they_need(capsys):
    names = ["refuses_what_is_expired", "gripper_stops", "spec_is_sound"]
    assert main(["check", "gripper:real-gripper", *(part for name in names for part in ("--only", name))]) == 0
    out = capsys.readouterr().out
    assert "2 motion checks skipped: pass --allow-motion and stay at the emergency stop" in out
    assert main(["check", "gripper:real-gripper", "--only", "refuses_what_is_expired", "--allow-motion"]) == 0
    printed = capsys.readouterr()
    assert "skipped" not in printed.out
    assert "is going to move" in printed.err


def test_json_holds_all_results(capsys, tmp_path):
    file = tmp_path / "checks.json"
    arguments = ["--only", "colours_are_rgb", "--only", "spec_is_sound", "--json"]
    assert main(["check", "sensor:fake-sensor", *arguments, str(file)]) == 0
    found = json.loads(file.read_text())
    assert (found["kind"], found["name"]) == ("sensor", "fake-sensor")
    assert found["counts"] == {"passed": 1, "failed": 0, "skipped": 0, "not applicable": 1}
    assert found["skipped"] == []
    assert {result["name"]: result["outcome"] for result in found["results"]} == {
        "colours_are_rgb": "not applicable",
        "spec_is_sound": "passed",
    }
    assert all(set(result) == {"name", "outcome", "message", "rule", "needs"} for result in found["results"])
    capsys.readouterr()
    assert main(["check", "sensor:fake-sensor", *arguments, "-"]) == 0
    assert json.loads(capsys.readouterr().out) == found


def test_checks_are_listed_without_the_options_that_a_device_needs(capsys, monkeypatch):
    monkeypatch.setattr(module, "host_of", lambda ctx: installed_host())
    assert main(["check", "gripper:hand-e", "--list"]) == 0
    assert "gripper_never_opens_on_failure" in capsys.readouterr().out
    assert main(["check", "gripper:hand-e"]) == 2


def test_the_list_runs_nothing(capsys, monkeypatch):
    monkeypatch.setattr(FakeGripper, "connect", lambda self: 1 / 0)
    assert main(["check", "gripper:fake-gripper", "--list"]) == 0
    out = capsys.readouterr().out
    assert "gripper_stops" in out
    assert "`stop` ends a motion of the fingers where they are." in out
    assert main(["check", "gripper:fake-gripper", "--list", "--json", "-"]) == 0
    assert {"name", "rule", "guide"} == set(json.loads(capsys.readouterr().out)["checks"][0])


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["gripper"], "is not KIND:NAME with one of the kinds sensor, gripper, arm"),
        (["cell:fake-cell"], "is not KIND:NAME with one of the kinds"),
        (["gripper:fake-griper"], "did you mean 'fake-gripper'?"),
        (["gripper:acme-2f"], "install a plugin of your own with pip install -e FOLDER"),
        (["gripper:fake-gripper", "--only", "gripper_stop"], "did you mean 'gripper_stops'?"),
        (["gripper:fake-gripper", "--set", "latency=3"], "latency: unknown key"),
        (["gripper:fake-gripper", "--set", "latency_ms"], "latency_ms"),
        ([], "Missing argument 'KIND:NAME'"),
    ],
)
def test_wrong_use_is_exit_code_2_with_a_remedy(capsys, arguments, problem):
    assert main(["check", *arguments]) == 2
    assert problem in capsys.readouterr().err


def test_options_reach_the_device(capsys):
    arguments = ["check", "gripper:fake-gripper", "--set", "fail=connect", "--only", "spec_is_sound"]
    assert main(arguments) == 1
    assert "ConnectFailed: fake-gripper: connect did not work" in capsys.readouterr().out


def test_a_missing_extra_is_named(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "hypothesis", None)
    assert main(["check", "gripper:fake-gripper"]) == 3
    assert "lsds check needs hypothesis" in (err := capsys.readouterr().err)
    assert "pip install 'lsds-tactile[testing]'" in err


@pytest.mark.parametrize(
    "arguments",
    [
        ["fault:gripper-offset"],
        ["wire_mock:hand-e"],
        ["study:scheduler", "--set", "repeats=1"],
        ["command:train"],
    ],
    ids=lambda arguments: arguments[0],
)
def test_faults_wire_mocks_studies_and_commands_are_checked(capsys, monkeypatch, arguments):
    monkeypatch.setattr(module, "host_of", lambda ctx: installed_host())
    assert main(["check", *arguments]) == 0
    assert " passed" in capsys.readouterr().out


def test_a_sound_algorithm_is_not_an_accurate_one(capsys, monkeypatch):
    monkeypatch.setattr(module, "host_of", lambda ctx: installed_host())
    assert main(["check", "detector:threshold", "--only", "detections_are_sound"]) == 0
    out = capsys.readouterr().out
    assert "the checks do not measure accuracy: lsds study slip RECORDINGS --detector threshold" in out


def test_checking_a_command_does_not_run_it(capsys, monkeypatch):
    host = PluginHost(entry_points=[])
    host.register(plugin(BackendSpec("command", "runs", "test_cli_check:runs", summary="run")), distribution="acme")
    monkeypatch.setattr(module, "host_of", lambda ctx: host)
    monkeypatch.setitem(sys.modules, "test_cli_check", sys.modules[__name__])
    checks = ("is_a_click_command", "help_names_it", "has_a_summary", "refuses_an_unknown_option")
    assert main(["check", "command:runs", *(part for name in checks for part in ("--only", name))]) == 0
    assert "4 passed" in capsys.readouterr().out
    assert main(["check", "command:runs", "--set", "times=2"]) == 2
    assert "times: a command takes no options" in capsys.readouterr().err


@click.command()
def runs():
    """Run."""
    raise AssertionError("the command was run")
