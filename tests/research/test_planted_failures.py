"""`lsds study search` finds a failure that is planted: a controller with the wrong delay.

A scenario counts as found if it fails in some way with the planted mistake, and not in that way without it.
"""

from __future__ import annotations

import json
from contextlib import nullcontext

import pytest
from lsds_research.search.robustness import Limits, run_scenario

from lsds.cli.main import main

pytestmark = pytest.mark.slow
LITTLE = Limits(slip_m=0.03, peak=5.0)
"""The limits of `lsds study search`."""


PLANTED = {
    "a controller with the wrong delay": (nullcontext, ("grip.answer_s=0.001",), (), 96),
}
"""By name: the mistake, config keys with it and without it, and the number of scenarios."""


def ways(margins):
    return {way for way, margin in margins.items() if margin < 0}


@pytest.mark.timeout(1800)
@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_mistake_is_found(name, tmp_path):
    plant, settings, healthy, runs = PLANTED[name]
    file = tmp_path / "found.json"
    more = [part for setting in settings for part in ("--with", setting)]
    with plant():
        # One process: the plant is in this one.
        asked = ["study", "search", "--runs", str(runs), "--most", "0", "--jobs", "1", "--no-plot", "--json", str(file)]
        assert main([*asked, *more]) == 0
    failed = [row for row in json.loads(file.read_text())["runs"] if row["margin"] < 0]
    failed.sort(key=lambda row: row["margin"])
    assert any(
        ways(row["margins"]) - ways(run_scenario((row["scenario"], LITTLE, healthy))["margins"]) for row in failed[:8]
    )
