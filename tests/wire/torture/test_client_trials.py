"""`lsds check KIND --client`: planted mistakes are found, a client without one has no finding, files repeat them."""

from __future__ import annotations

import json
import re
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from lsds.cli.check_client import _planned
from lsds.cli.main import main
from lsds.errors import DataError
from lsds.testing.torture import campaign, course
from lsds.testing.torture.campaign import Outcome, cases_of, faults_of, run_case, saved_cases
from lsds.testing.torture.cases import MOCKS, Case, possible
from lsds.testing.torture.course import started
from lsds.testing.torture.driven import CLOCK, Call, DrivenClient
from lsds.testing.torture.judging import is_right
from tests.wire.waiting import until

pytest.importorskip("pymodbus", reason="pymodbus is not installed: pip install pymodbus")
ROOT = Path(__file__).parents[3]
CLIENTS = "tests.wire.torture.clients"


@pytest.fixture(autouse=True)
def _in_the_root(monkeypatch):
    monkeypatch.chdir(ROOT)


def tried(name, fault="drop", severity=5):
    base = Case("gripper", "hand-e", name if ":" in name else f"{CLIENTS}:{name}")
    faults = faults_of(base, [fault])
    (planned,) = [(case, own) for case, own in cases_of(base, faults, 1) if case.severity in (severity, None)]
    return run_case(*planned)


def kinds(outcome):
    return [finding.kind for finding in outcome.findings]


@pytest.mark.parametrize(
    ("client", "kind", "text"),
    [
        pytest.param("Hangs", "hang", r"read\(\) did not return within 10.0 s", marks=pytest.mark.slow),
        pytest.param("Dies", "crash", r"its process died with signal 6", marks=pytest.mark.slow),
        pytest.param("Leaves", "crash", r"died with exit code 7: giving up, in read\(\)", marks=pytest.mark.slow),
        ("Repeats", "wrong value", r"the device was at"),
        ("Opens", "opened", r"the fingers opened from \d+\.\d to \d+\.\d mm"),
        pytest.param(
            "IgnoresCommands",
            "did not follow",
            r"move\(\) returned and the fingers did not move",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_planted_mistake_is_found(client, kind, text):
    outcome = tried(client)
    assert outcome.broken == ""
    assert kind in kinds(outcome)
    (found, *_) = [finding for finding in outcome.findings if finding.kind == kind]
    assert re.search(text, found.text), found.text


SLOW = [pytest.param(fault, marks=pytest.mark.slow) for fault in ("corrupt", "freeze", "disconnect")]


@pytest.mark.parametrize("fault", ["drop", *SLOW])
def test_a_client_that_reports_what_it_cannot_do_has_no_finding(fault):
    outcome = tried("examples.clients.pymodbus_hand_e:Client", fault)
    assert (outcome.broken, outcome.findings) == ("", ())
    assert outcome.recovery_s is not None
    assert outcome.recovery_s < 1.0
    assert (outcome.errors > 0) == (fault != "freeze")


def test_a_healthy_line_has_no_finding():
    outcome = run_case(Case("gripper", "hand-e", "examples.clients.pymodbus_hand_e:Client"), None)
    assert (outcome.broken, outcome.findings, outcome.errors) == ("", (), 0)


@pytest.mark.parametrize(("kind", "least"), [("gripper", 12), ("arm", 9), ("sensor", 8)])
def test_a_mock_is_asked_for_its_faults(kind, least):
    with started(Case(kind, MOCKS[kind], "any:One"), "", {}) as mock:
        found = possible(mock)
        assert mock.process.complaints == ""
    assert len(found) >= least
    names = {fault.kind: fault for fault in found}
    assert names["drop"].scaled
    assert not names["freeze"].scaled


def ended(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return True


def test_processes_that_a_client_leaves_end_with_it():
    with DrivenClient(f"{CLIENTS}:LeavesAProcess") as client:
        client.described()
        client.call("connect", "tcp://127.0.0.1:1", limit_s=10.0)
        left = int(client.call("read", limit_s=10.0).value)
        began_s = time.monotonic()
    assert time.monotonic() - began_s < 10.0
    assert until(lambda: ended(left))  # a killed process ends when it is next scheduled


@pytest.mark.parametrize("text", ["[1]", "3", '{"outcomes": [[]]}', '{"case": {"kind": "arm"}}'])
def test_a_file_of_anything_else_is_one_error(tmp_path, text):
    file = tmp_path / "other.json"
    file.write_text(text)
    with pytest.raises(DataError, match="is no finding of lsds check --client"):
        list(saved_cases(file))


class ReadsOnce:
    """A client whose reads all fail but the first."""

    alive, reads = True, 0

    def call(self, name, *_, limit_s):
        self.reads += name == "read"
        good = {"size": [24, 32, 3], "grey": [[0.0] * 32] * 24}
        now_ns = CLOCK.now()
        return Call(name, now_ns, now_ns, good) if self.reads < 2 else Call(name, now_ns, now_ns, None, "no image")

    def death(self):
        return None


def test_a_camera_without_a_reference_image_cannot_begin(monkeypatch):
    monkeypatch.setattr(course, "ADJUSTS_S", 0.01)
    mock = SimpleNamespace(address="http://127.0.0.1:1", truths=lambda _: [])
    case = Case("sensor", "gelsight-mini", "any:One")
    found = course.run_course(course.Course(case), mock, ReadsOnce(), None, is_right, 1.0)
    assert found.broken == "read() on a healthy line: no image"


# -- the command ----------------------------------------------------------------------------------------------


def command(*arguments):
    return main(["check", *arguments])


@pytest.mark.slow
def test_the_command_saves_a_file_that_repeats_the_finding(tmp_path, capsys):
    found = tmp_path / "found"
    client = ("gripper", "--client", f"{CLIENTS}:Dies")
    assert command(*client, "--faults", "drop", "--found", str(found), "--json", str(tmp_path / "all.json")) == 1
    report = json.loads((tmp_path / "all.json").read_text())
    assert report["counts"]["crash"] >= 1
    assert len(report["outcomes"]) == 5
    assert "5 cases: " in capsys.readouterr().out
    file = found / f"{CLIENTS}.Dies-drop-5-0.json"
    assert [case.severity for case in saved_cases(file)] == [5]
    assert command(*client, "--faults", str(file), "--repeats", "2") == 1
    assert "2 x crash" in capsys.readouterr().out


def test_a_case_that_cannot_begin_is_no_success(monkeypatch, capsys):
    """Without it a client that every fault keeps from beginning would pass."""
    case = Case("gripper", "hand-e", f"{CLIENTS}:Works")
    broken = Outcome(case, (), None, 1, 1, "", "it does not connect")
    monkeypatch.setattr(campaign, "run_case", lambda *_: replace(broken, broken=""))
    monkeypatch.setattr(campaign, "run_cases", lambda *_, **__: [broken])
    assert command("gripper", "--client", f"{CLIENTS}:Works", "--faults", "none") == 1
    assert "1 could not begin" in capsys.readouterr().out


def test_a_folder_that_cannot_be_made_is_found_before_the_trials(tmp_path, capsys):
    file = tmp_path / "file"
    file.touch()
    assert command("gripper", "--client", f"{CLIENTS}:Works", "--found", str(file / "found")) == 5
    assert f"--found {file / 'found'}: the folder cannot be made" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("gripper", "--client", f"{CLIENTS}:Nothing"), 5, r"client .*:Nothing: AttributeError.*write MODULE:CLASS"),
        (("gripper", "--client", "nowhere"), 5, r"'nowhere' is not MODULE:CLASS"),
        (("gripper", "--client", f"{CLIENTS}:Refuses"), 1, "does not connect to tcp://.*ConnectionRefusedError"),
        (("gripper", "--client", f"{CLIENTS}:IsWrong"), 1, r"healthy line.*read\(\) returned .* the device was at"),
        (("gripper", "--client", f"{CLIENTS}:Works", "--faults", "dropp"), 5, "no fault 'dropp'; did you mean 'drop'"),
        (("gripper", "--client", f"{CLIENTS}:Works", "--faults", "no.json"), 5, "no.json: is no finding"),
        (("detector", "--client", f"{CLIENTS}:Works"), 2, "'detector' has no course for a client"),
        (("gripper:mock-hand-e", "--faults", "all"), 2, "--faults and --found need --client"),
        (("gripper", "--client", f"{CLIENTS}:Works", "--list"), 2, "leave out --only, --list"),
        (("gripper:no-mock", "--client", f"{CLIENTS}:Works"), None, "no-mock"),
    ],
)
def test_wrong_use_is_one_error(arguments, code, message, capsys):
    returned = command(*arguments)
    error = capsys.readouterr().err
    assert re.search(message, error), error
    assert returned == code if code is not None else returned != 0
    assert "Traceback" not in error


@pytest.mark.parametrize(("seed", "seeds"), [(None, [7, 8]), (3, [3, 4])])
def test_a_finding_is_repeated_with_what_is_given(tmp_path, seed, seeds):
    own = Case("gripper", "hand-e", "somewhere:Client", seed=7, settings=(("tcp", {"port": 1, "backlog": 2}),))
    (file := tmp_path / "finding.json").write_text(json.dumps({"case": own.as_json()}), encoding="utf-8")
    base = replace(own, client="mine:Client", settings=())
    planned = _planned(base, str(file), 2, seed, ["tcp.port=5"])
    assert [case.seed for case, _ in planned] == seeds
    assert {case.client for case, _ in planned} == {"mine:Client"}
    assert [dict(case.settings) for case, _ in planned] == [{"tcp": {"port": 5, "backlog": 2}}] * 2
