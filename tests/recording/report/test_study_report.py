"""The page of a study: every table, note and option is in it, and its plot works in a browser."""

from __future__ import annotations

import json
import re
from datetime import UTC, datetime

import pytest

from lsds.cli.main import main
from lsds.cli.study_report import Made, page_of
from lsds.contracts.study import StudyResult, StudyTable
from tests.recording.report.browser import MISSING, chromium

pytest.importorskip("plotly", reason="reports need the extra report")

COLUMNS = (("name", "object", ""), ("slip_mm", "slip, mm", ".2f"), ("grip", "grip / needed", ".2f"))
ROWS = [{"name": "<b>ball</b>", "slip_mm": 1.25, "grip": 1.5}, {"name": "{{script}}", "slip_mm": None, "grip": 1.25}]
RUNS = [
    {"scenario": {"mass_g": 100.0 * k, "shape": "ball</script>"}, "slip_mm": 0.5 * k, "outcome": outcome, "list": [1]}
    for k, outcome in enumerate(["held", "held", "dropped", "held"])
]
MADE = Made("grip", {"seeds": 3}, 7, 12.4)
AT = datetime(2026, 1, 2, tzinfo=UTC)


def result(**changes):
    found = {"title": "lifts (simulated)", "columns": COLUMNS, "rows": ROWS, "notes": ["one <note>"]} | changes
    return StudyResult(**found)


def data_of(page):
    return json.loads(re.search(r'id="data">(.*?)</script>', page, re.DOTALL)[1])


def test_a_page_holds_tables_notes_options_and_how_it_was_made():
    more = [StudyTable((("part", "part", ""),), [{"part": "gel"}])]
    page = page_of(result(more=more, warnings=["a lift failed"]), MADE, AT)
    for text in (
        "lifts (simulated)",
        "one &lt;note&gt;",
        "a lift failed",
        "&quot;seeds&quot;: 3",
        "12 s",
        "2026-01-02",
    ):
        assert text in page
    assert "<td class=number>1.25</td>" in page
    assert "&lt;b&gt;ball&lt;/b&gt;" in page
    assert "<b>ball" not in page.split('id="data"')[0]
    assert "<td>{{script}}</td>" in page
    assert page.index("<td>gel</td>") < page.index("slip, mm")


def test_the_plot_has_the_single_runs_and_else_the_rows():
    rows = data_of(page_of(result(), MADE, AT))
    assert [column["name"] for column in rows["columns"]] == ["object", "slip, mm", "grip / needed"]
    runs = data_of(page_of(result(details={"runs": RUNS}), MADE, AT))
    assert [column["key"] for column in runs["columns"]] == ["scenario.mass_g", "scenario.shape", "slip_mm", "outcome"]
    assert runs["rows"][2]["scenario.mass_g"] == 200.0
    assert data_of(page_of(result(details={"runs": 5}), MADE, AT)) == rows


def test_a_number_that_is_unknown_is_null():
    rows = data_of(page_of(result(rows=[{"name": "a", "slip_mm": float("nan")}]), MADE, AT))["rows"]
    assert rows == [{"name": "a", "slip_mm": None}]


def test_a_missing_folder_is_an_error_before_the_study_runs(tmp_path, capsys):
    assert main(["study", "scheduler", "--no-plot", "--report", str(tmp_path / "none" / "page.html")]) != 0
    assert "folder does not exist" in capsys.readouterr().err


@pytest.mark.skipif(bool(MISSING), reason=MISSING)
def test_the_page_works_in_a_browser(tmp_path):
    out = tmp_path / "study.html"
    out.write_text(page_of(result(details={"runs": RUNS}), MADE, AT), encoding="utf-8")
    with chromium() as window:
        window.open(out)
        assert window.run("[...document.getElementById('across').options].map((o) => o.text)") == [
            "scenario.mass_g",
            "slip_mm",
        ]
        assert window.run("document.querySelectorAll('#plot .scatterlayer .trace').length") == 2
        window.run("document.getElementById('colour').value = ''")
        window.run("document.getElementById('colour').dispatchEvent(new Event('change'))")
        window.wait("document.querySelectorAll('#plot .scatterlayer .trace').length === 1")
        window.run("document.querySelector('table.rows thead th').click()")
        first = "document.querySelector('table.rows tbody td').textContent"
        upwards = window.run(first)
        window.run("document.querySelector('table.rows thead th').click()")
        assert {upwards, window.run(first)} == {"<b>ball</b>", "{{script}}"}
        assert window.log("browser") == []
