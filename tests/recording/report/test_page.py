"""A report holds what its recording holds, and loads nothing."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace

import pytest
from click.testing import CliRunner

from lsds.cli.main import cli
from lsds.errors import DataError
from lsds.session.recording.files import cut
from lsds.session.recording.report.figure import figure_of
from lsds.session.recording.report.gather import gather
from lsds.session.recording.report.page import page_of, write_report
from lsds.session.recording.report.tables import outcome_of, result_rows, simulation_rows
from lsds.session.run import run
from lsds.support.human import length
from tests.recording.conftest import SHORT

pytest.importorskip("plotly", reason="reports need the extra report")


@pytest.fixture(scope="module")
def page(recorded, tmp_path_factory):
    path, _ = recorded
    out = tmp_path_factory.mktemp("report") / "run.html"
    assert write_report(path, out) == ""
    return out.read_text(encoding="utf-8")


def data_of(page):
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)[1])


def without_library(page):
    return re.sub(r'(?s)(id="library">).*?(</script>)', r"\1\2", page)


def test_a_page_loads_nothing_from_elsewhere_and_is_small(page):
    rest = without_library(page)
    assert re.findall(r"https?://|//\w+\.\w+/|\b(?:src|href)=", rest) == []
    assert "default-src 'none'" in rest
    assert len(page) < 5_000_000


def test_a_page_shows_the_outcome_and_that_it_is_simulated(recorded, page):
    _, session = recorded
    rest = without_library(page)
    assert "run.mcap: held (simulated)" in rest
    slip = f"{length(session.summary['slip_distance_m'])} (simulated)"
    assert f"<th>slip distance</th><td>{slip}</td>" in rest
    assert f"<th>frames</th><td>{session.summary['cycles']}</td>" in rest
    for text in ("seed = 5", "task sensor", "plotly.js of this page", "numpy", "all images,"):
        assert text in rest


def test_curves_and_events_are_those_of_the_run(recorded, page):
    _, session = recorded
    data = data_of(page)
    names = [trace["name"] for trace in data["figure"]["data"] if "name" in trace]
    assert len(names) == 9
    assert all(name.endswith("(simulated)") for name in names)
    curves = {trace["name"].removesuffix(" (simulated)"): trace for trace in data["figure"]["data"] if "name" in trace}
    peak = 100 * max(sample.speed_m_s for sample in session.record.samples if sample.speed_m_s == sample.speed_m_s)
    assert max(filter(None, curves["estimated ± 1 sigma"]["y"])) == pytest.approx(peak, rel=1e-4)
    true = 100 * session.summary["peak_slip_speed_m_s"]
    assert max(curves["true"]["y"]) == pytest.approx(true, rel=1e-4)
    assert [each["name"] for each in data["stages"]][-2:] == ["lift", "hold"]
    assert page.count('<td class="correction">') == len(curves["wanted by the controller"]["x"]) > 0
    assert page.count('<td class="stage">') >= len(data["stages"])


def test_a_fault_is_an_event_with_its_reason(tmp_path):
    path = tmp_path / "run.mcap"
    run(None, [*SHORT, 'faults=[{backend="camera-gone", at="lift"}]'], record=path)
    data = gather(path)
    faults = [each.text for each in data.happenings if each.kind == "fault"]
    assert faults[0] == "camera-gone began on purpose"
    assert faults[1] == data.summary["fault"]
    page = without_library(page_of(data))
    assert "fault (simulated)" in page
    assert f"<p>{html.escape(data.summary['fault'])}</p>" in page


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_a_truncated_recording_gives_a_page_with_a_note(recorded, tmp_path, share):
    path, _ = recorded
    short, out = tmp_path / "short.mcap", tmp_path / "short.html"
    short.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    assert write_report(short, out)
    page = out.read_text(encoding="utf-8")
    assert "The recording is incomplete: damaged or cut off near byte" in page
    assert "outcome not recorded (simulated)" in page
    assert data_of(page)["images"]["finger"]["urls"]


def test_a_part_without_grip_has_a_page(recorded, tmp_path):
    path, _ = recorded
    part = tmp_path / "part.mcap"
    cut(path, part, 0.0, 0.3)
    data = gather(part)
    assert data.end_s < 0.31
    assert [stage.name for stage in data.stages] == ["reference"]
    assert data_of(page_of(data))["figure"]["layout"]["xaxis"]["range"] == [data.begin_s, data.end_s]


def test_no_file_is_overwritten(recorded, tmp_path):
    path, _ = recorded
    out = tmp_path / "run.html"
    out.write_text("mine")
    with pytest.raises(DataError, match="exists already"):
        write_report(path, out)
    assert out.read_text() == "mine"
    with pytest.raises(DataError, match="no folder"):
        write_report(path, tmp_path / "missing" / "run.html")
    done = CliRunner().invoke(cli, ["run", "--no-plot", "--report", str(out)])
    assert done.exit_code != 0
    assert out.read_text() == "mine"


def test_names_of_a_recording_cannot_add_elements_to_a_page(recorded):
    path, _ = recorded
    data = gather(path)
    nasty = '</script><script>alert(1)</script>{{config}}"'
    data.stages = [stage._replace(name=nasty) for stage in data.stages]
    data.happenings = [each._replace(text=nasty) for each in data.happenings]
    data.images = {nasty: data.images["finger"]}
    data.header = replace(data.header, config=nasty)
    page = page_of(data)
    assert "<script>alert" not in page
    assert data_of(page)["stages"][0]["name"] == nasty


def test_a_run_writes_its_report_and_leaves_no_recording(tmp_path, monkeypatch):
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    out = tmp_path / "run.html"
    chosen = [word for each in SHORT for word in ("--set", each)]
    done = CliRunner().invoke(cli, ["run", "--no-plot", *chosen, "--report", str(out)])
    assert done.exit_code == 0, done.output
    assert f"report: {out}" in done.output
    assert "recording:" not in done.output
    assert "held (simulated)" in out.read_text(encoding="utf-8")
    assert not list(folder.glob("lsds-report-*"))


def test_the_command_makes_a_page_of_a_recording(recorded, tmp_path):
    path, _ = recorded
    out = tmp_path / "run.html"
    done = CliRunner().invoke(cli, ["record", "report", str(path), "--out", str(out)])
    assert (done.exit_code, done.output) == (0, f"report: {out}\n")
    assert out.stat().st_size > 1_000_000


def test_a_page_states_what_was_simulated_and_what_was_not(recorded):
    path, _ = recorded
    data = gather(path)
    header = data.header
    assert (
        simulation_rows(data)[0][1]
        == "the cell 'simulated' with the devices in it; the images of the sensors come from it"
    )
    # A real sensor with a simulated gripper.
    data.header = replace(header, simulated=False)
    assert simulation_rows(data)[0][1].endswith("the images do not come from it")
    assert "slip distance" in dict(result_rows(data))
    # A real cell.
    data.summary["figures_are"] = "measured"
    data.header = replace(header, simulated=False, config=header.config.replace('[cell]\nbackend = "simulated"', ""))
    assert simulation_rows(data)[0][1].startswith("nothing that lsds knows of")
    assert outcome_of(data)[0] == "held (measured)"
    assert not any("simulated" in value for _, value in result_rows(data))
    assert not any("simulated" in trace.get("name", "") for trace in figure_of(data)["data"])
