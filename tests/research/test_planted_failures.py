"""`lsds study search` finds failures that are planted: a wrong delay, a guard that opens.

A scenario counts as found if it fails in some way with the planted mistake, and not in that way without it.
"""

from __future__ import annotations

import json
from contextlib import nullcontext
from unittest.mock import patch

import pytest
from lsds_research.search.robustness import Limits, run_scenario

from lsds.cli.main import main
from lsds.safety.guard import Guard

pytestmark = pytest.mark.slow
OPENS_ON_SLIP = ("controller.backend=pd", "controller.pd.literal_sign=true")
"""The paper's literal sign, which asks the gripper to open on slip; the guard keeps it closed."""
LITTLE = Limits(slip_m=0.03, peak=5.0)
"""The limits of `lsds study search`."""


def guarded(gripper):
    return lambda self, command, held_m, *, allow_opening: gripper(self, command, held_m, allow_opening=True)


PLANTED = {
    "a controller with the wrong delay": (nullcontext, ("grip.answer_s=0.001",), (), 96),
    "a guard without the opening rule": (
        lambda: patch.object(Guard, "gripper", guarded(Guard.gripper)),
        OPENS_ON_SLIP,
        OPENS_ON_SLIP,
        24,
    ),
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
