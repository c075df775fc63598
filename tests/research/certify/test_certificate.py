"""Study `certify`: the space of objects, a simulated cell for a real rig, the budget, the page and the files."""

from __future__ import annotations

import contextlib
import json
import re

import numpy as np
import pytest
from lsds_research.certify.duration import seconds_of
from lsds_research.certify.options import CertifyOptions
from lsds_research.certify.rig import simulated_rig
from lsds_research.certify.sequential import Estimate
from lsds_research.certify.study import QUICK_RUNS, CertifyStudy, _figures, _undecided, _within
from lsds_research.search import scenarios
from lsds_research.search.objects import OBJECTS, completed
from lsds_research.search.robustness import Limits
from lsds_research.search.space import point_to_scenario

from lsds.cli.main import main
from lsds.clock import WallClock
from lsds.config import load_config
from lsds.config.overrides import override_texts
from lsds.contracts import BuildContext
from lsds.errors import ConfigError, DataError
from lsds.registry.host import PluginHost

pytest.importorskip("sklearn", reason="scikit-learn is not installed: pip install '.[search]'")
QUICK = ("--with", "cell.simulated.fidelity=winkler", "--with", "task.hold_s=0.3", "--with", "task.lift_s=0.3")


@pytest.mark.parametrize("seed", range(8))
def test_each_point_of_the_space_is_a_config(seed):
    point = np.random.default_rng(seed).random(len(OBJECTS))
    scenario = completed(point_to_scenario(OBJECTS, point))
    cell = load_config(None, override_texts(scenario)).cell.model_extra["simulated"]
    assert 0.7 <= cell["kinetic_friction"] / cell["static_friction"] <= 0.95
    if cell["shape"] == "sphere":
        assert cell["length_mm"] == max(20.0, cell["diameter_mm"])


@pytest.mark.parametrize(("text", "seconds"), [("90s", 90), ("10min", 600), ("1.5 h", 5400)])
def test_a_budget_is_written_as_people_do(text, seconds):
    assert seconds_of(text, "--budget") == seconds


@pytest.mark.parametrize("text", ["", "10", "ten minutes", "-5min", "0s"])
def test_any_other_budget_is_one_error(text):
    with pytest.raises(DataError, match=r"--budget .* is no duration up to 1000h; write 90s, 10min or 2h"):
        seconds_of(text, "--budget")


def test_a_real_rig_is_simulated_by_its_specs(tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text(
        '[gripper]\nbackend = "hand-e"\n[gripper.hand-e]\nport = "/dev/ttyUSB0"\n'
        '[sensor]\nbackend = "gelsight-mini"\n[arm]\nbackend = "ur5e"\n[arm.ur5e]\nhost = "192.168.1.2"\n'
        '[cell]\nbackend = "none"\n[task]\nlift_speed_m_s = 0.02\n'
    )
    keys, notes = simulated_rig(rig, PluginHost())
    config = load_config(None, keys)
    assert config.gripper.backend == "mock-hand-e"
    assert config.arm.backend == "mock-ur5e"
    assert config.task.lift_speed_m_s == 0.02
    assert len(notes) == 4
    assert notes[0].startswith("gripper 'hand-e': mock-hand-e with stroke_mm = 50.0")
    assert notes[3] == "cell.backend = 'none': left out, because the cell is simulated"


@pytest.mark.parametrize("device", ["", '[arm]\nbackend = "none"\n'])
def test_a_rig_keeps_its_simulated_cell_and_its_faults(tmp_path, device):
    """A replaced arm dropped the whole cell, its friction too, without a word."""
    rig = tmp_path / "rig.toml"
    rig.write_text(f'{device}[cell.simulated]\nfriction_scale = 0.3\n[[faults]]\nbackend = "camera-noise"\n')
    keys, notes = simulated_rig(rig, PluginHost())
    config = load_config(None, keys)
    assert config.cell.options()["friction_scale"] == 0.3
    assert [fault.backend for fault in config.faults] == ["camera-noise"]
    assert len(notes) == bool(device)


def test_a_simulated_rig_is_used_as_it_is(tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text("[task]\nlift_speed_m_s = 0.02\n[gripper.mock-hand-e]\nlatency_ms = 80.0\n")
    assert simulated_rig(rig, PluginHost()) == (["task.lift_speed_m_s=0.02", "gripper.mock-hand-e.latency_ms=80.0"], [])


def test_a_calibration_file_is_found_from_any_folder(tmp_path, monkeypatch):
    (tmp_path / "grip.toml").write_text("[grip]\npower = 1.2\n")
    rig = tmp_path / "rig.toml"
    rig.write_text('calibration = ["grip.toml"]\n')
    monkeypatch.chdir(tmp_path.parent)
    keys, _ = simulated_rig(rig, PluginHost())
    assert load_config(None, keys).grip.power == 1.2


def test_a_quick_certificate_keeps_a_given_budget():
    context = BuildContext(WallClock(), 0)
    assert CertifyStudy(CertifyOptions(quick=True), context)._runs == QUICK_RUNS
    assert CertifyStudy(CertifyOptions(quick=True, runs=3), context)._runs == 3
    assert CertifyStudy(CertifyOptions(quick=True, budget="20s"), context)._runs == 0


def test_a_rig_that_is_not_valid_is_one_error(tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text("[task]\nlift_sped_m_s = 0.02\n")
    with pytest.raises(ConfigError, match="lift_sped_m_s"):
        simulated_rig(rig, PluginHost())


@pytest.mark.slow
def test_the_certificate_is_the_same_on_one_and_two_processes(tmp_path):
    pytest.importorskip("plotly", reason="reports need the extra report")
    certificates = []
    for jobs in (1, 2):
        file, page = tmp_path / f"{jobs}.json", tmp_path / f"{jobs}.html"
        asked = ["study", "certify", "--runs", "32", "--jobs", str(jobs), *QUICK, "--report", str(page)]
        assert main([*asked, "--json", str(file), "--no-plot", "--found", str(tmp_path / str(jobs))]) == 0
        certificates.append(json.loads(file.read_text()))
        assert "(simulated)" in page.read_text()
        assert "without a real gel, object or hand" in page.read_text()
    one, two = certificates
    assert one["probability"] == two["probability"]
    assert one["runs"] == two["runs"]
    for file in one["files"]:
        assert main(["run", file, "--no-plot"]) in (8, 11)


def certificate(tmp_path, *flags):
    file = tmp_path / "certificate.json"
    assert main(["study", "certify", *flags, "--jobs", "1", *QUICK, "--json", str(file), "--no-plot"]) == 0
    return json.loads(file.read_text())


def test_a_short_budget_ends_within_a_lift_and_a_number_of_lifts_is_kept(tmp_path):
    short = certificate(tmp_path, "--budget", "1s")
    assert 1 <= short["probability"]["runs"] < 16
    assert short["took_s"] < 1.1 or any("instead of 1 s: a lift is not cut off" in note for note in short["notes"])
    assert certificate(tmp_path, "--runs", "3")["probability"]["runs"] == 3


@pytest.mark.parametrize("jobs", [1, 3])
def test_a_number_of_lifts_is_kept_whatever_finishes_first(jobs, monkeypatch):
    def shuffled(work, items):
        return iter(
            [(item, {"margins": {"holds": 1.0}, "outcome": "held", "number": k}) for k, item in enumerate(items)][::-1]
        )

    joined = []

    @contextlib.contextmanager
    def sharing(jobs, cluster):
        joined.append(jobs)
        yield shuffled
        joined.append("left")

    monkeypatch.setattr(scenarios, "sharing", sharing)
    used = []

    def draw():
        while sum(used) < 5:
            used.append(len((yield [np.array([0.1 * k]) for k in range(4)])))
        return "done"

    axes = OBJECTS[:1]
    with scenarios.Scenarios(Limits(), (), "", jobs, "") as runs:
        answered, last = runs.answer(
            axes, draw(), lambda row: 1.0, lambda *_: None, room=lambda count: min(jobs, 5 - count)
        )
    assert joined == [jobs, "left"], "processes are kept from batch to batch"
    assert (last, used) == ("done", [4, 1])
    points = [row["point"][0] for rows in answered for row in rows]
    assert points == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.0])


@pytest.mark.parametrize("flags", [("--budget", "10"), ("--budget", "-5s"), ("--budget", "5s", "--runs", "5")])
def test_a_wrong_budget_is_a_mistake_of_the_command_line(flags, capsys):
    assert main(["study", "certify", *flags]) == 2
    assert re.search("is no duration|budget and runs exclude each other", capsys.readouterr().err)


def test_drops_outside_the_model_are_counted_apart():
    rows = [
        {"outcome": "dropped", "margin": -1.0, "invalid": True},
        {"outcome": "dropped", "margin": -1.0, "invalid": False},
        {"outcome": "held", "margin": 1.0, "invalid": False},
        {"outcome": "outside the model's validity", "margin": 1.0, "invalid": True},
    ]
    estimate = Estimate(0.5, 0.1, 0.9, 2, 4, np.full(4, 0.25), float("nan"))
    outside = _figures(rows, estimate)[-1]
    assert (outside["value"], outside["range"]) == ("50.0%", "dropped: 25.0%; the rest counts as held")
    (note,) = _within(rows, estimate)
    assert note == "within the model's validity 1 of 2 lifts dropped, 50.0% of that part of the space"
    assert _within(rows[1:3], Estimate(0.5, 0.1, 0.9, 1, 2, np.full(2, 0.5), float("nan"))) == []


def test_lifts_that_show_nothing_are_not_silently_held():
    estimate = Estimate(0.1, 0.05, 0.2, 1, 4, np.full(4, 0.25), float("nan"))
    rows = [
        {"outcome": "fault", "margins": {"named": 0.1}},
        {"outcome": "held", "margins": {"holds": 1.0}},
        {"outcome": "dropped", "margins": {"holds": -1.0}},
        {"outcome": "outside the model's validity", "margins": {"holds": 1.0}},
    ]
    (note,) = _undecided(rows, estimate)
    assert note.startswith("50.0% of the lifts were stopped or are outside the model")
    assert note.endswith("the probability would be 60.0%")
    assert _undecided([rows[1]], Estimate(0.0, 0.0, 0.1, 0, 1, np.ones(1), float("nan"))) == []
