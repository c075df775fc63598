"""`lsds run` prints a short summary, all of it with `--verbose`, and all of it in the JSON."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from lsds.cli.main import main
from lsds.cli.run_summary import full_table, short_table

pytestmark = pytest.mark.usefixtures("installed_host")
README = Path(__file__).parents[2] / "README.md"
MOST_LINES = 12
"""Lines of the short summary, with its head and the line that names the picture."""


@pytest.fixture(scope="module")
def summary(tmp_path_factory):
    file = tmp_path_factory.mktemp("run") / "run.json"
    assert main(["run", "--no-plot", "--json", str(file)]) == 0
    return json.loads(file.read_text(encoding="utf-8"))


def test_the_readme_shows_what_the_first_command_prints(capsys, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib", reason="the picture needs the extra plot")
    monkeypatch.chdir(tmp_path)
    assert main(["run"]) == 0
    shown = re.search(r"<!-- output of lsds run -->\n```text\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    assert capsys.readouterr().out == shown[1]


def test_the_short_summary_is_short_and_begins_with_the_verdict(summary):
    lines = short_table(summary).splitlines()
    assert len(lines) < MOST_LINES
    assert re.match(r"outcome +held \(simulated\)", lines[2])
    assert lines[3].startswith("reason")
    assert not re.search(r"\de[+-]\d|\bus\b|cm/s", short_table(summary))


def test_the_short_summary_has_no_figure_of_this_computer(summary):
    changed = {
        **summary,
        "frame_to_command_us": {"p50": 20710.0, "p99": 1e6},
        "realtime_factor": 0.01,
        "timing": {**summary["timing"], "imprint_us": {"p50": 1.0, "p99": 2.0}},
    }
    assert short_table(changed) == short_table(summary)
    assert re.search(r"image to command +20.7 ms median, 1000 ms p99|20.7 ms median, 1 s p99", full_table(changed))


def test_missed_cycles_and_a_stop_are_in_the_short_summary(summary):
    changed = {**summary, "overruns": 7, "stop_report": "the arm stands"}
    assert re.search(r"missed cycles +7$", short_table(changed), re.MULTILINE)
    assert re.search(r"afterwards +the arm stands$", short_table(changed), re.MULTILINE)


def test_corrections_that_the_guard_refused_are_in_the_summary(summary):
    assert "refused" not in short_table(summary)
    changed = {**summary, "guard": {**summary["guard"], "kept_closed": 33}}
    for text in (short_table(changed), full_table(changed)):
        assert re.search(
            r"refused, would open +33: the controller does not state that it may open$", text, re.MULTILINE
        )


def test_without_truth_the_summary_states_that_slip_and_grip_are_unknown(summary):
    keys = ("slip_distance_m", "peak_normal_force_n", "steady_normal_force_n", "required_normal_force_n")
    text = short_table({**summary, **dict.fromkeys(keys), "simulation": None})
    assert len(re.findall("unknown without the simulation's truth", text)) == 2
    assert "gel model" not in text


@pytest.mark.parametrize("width", [80, 40])
def test_both_summaries_fit_a_narrow_terminal(summary, monkeypatch, width):
    monkeypatch.setenv("COLUMNS", str(width))
    for text in (short_table(summary), full_table(summary)):
        assert max(map(len, text.splitlines())) <= width


def test_verbose_prints_every_row(capsys, tmp_path):
    quick = ["--set", "task.lift_s=0.6", "--set", "task.hold_s=0.3", "--set", "cell.simulated.fidelity=winkler"]
    file = tmp_path / "run.json"
    main(["run", "--no-plot", "--verbose", "--json", str(file), *quick])
    printed = capsys.readouterr().out
    summary = json.loads(file.read_text(encoding="utf-8"))
    assert printed == full_table(summary) + "\n"
    for warning in summary["simulation"]["warnings"]:
        assert warning in printed
    main(["run", "--no-plot", *quick])
    assert capsys.readouterr().out == short_table(summary) + "\n"
