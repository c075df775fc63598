"""`lsds study search` finds a failure that is planted: a controller with the wrong delay."""

from __future__ import annotations

import json

import pytest
from lsds_research.search.robustness import Limits, run_scenario

from lsds.cli.main import main

LITTLE = Limits(slip_m=0.03, peak=5.0)
"""The limits of `lsds study search`."""


def ways(margins):
    return {way for way, margin in margins.items() if margin < 0}


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_a_controller_with_the_wrong_delay_is_found(tmp_path):
    """It believes that the fingers answer after 1 ms. Some scenario fails in a way in which the default does not."""
    file = tmp_path / "found.json"
    asked = ["study", "search", "--runs", "96", "--most", "0", "--no-plot", "--json", str(file)]
    assert main([*asked, "--with", "grip.answer_s=0.001"]) == 0
    failed = [row for row in json.loads(file.read_text())["runs"] if row["margin"] < 0]
    failed.sort(key=lambda row: row["margin"])
    assert any(
        ways(row["margins"]) - ways(run_scenario((row["scenario"], LITTLE, ()))["margins"]) for row in failed[:8]
    )
