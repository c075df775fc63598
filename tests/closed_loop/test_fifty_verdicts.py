"""Fifty scenarios drawn at random: `lsds run`, the studies of grip and of faults, and the search give one verdict."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from lsds_research.search.robustness import Limits, run_scenario
from lsds_research.studies.faults.case import Case, run_case
from lsds_research.studies.grip.lift import OFF, Lift, lift

from lsds.cli.main import main
from lsds.session.verdict import Outcome

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("installed_host")]
FAILURES = {Outcome.DROPPED, Outcome.NOT_LIFTED, Outcome.CRUSHED, Outcome.SLIPPED}
QUICK = ("cell.simulated.fidelity=winkler", "task.lift_s=0.8", "task.hold_s=0.4")
SCENARIOS = 50
FAULTS = ("", "", "detector-silent", "camera-gone", "detector-alarms", "gripper-frozen")
OBJECTS = ("pvc-pipe", "ball", "book", "sponge")


def drawn():
    """Return the scenarios: a lift, limits and a fault each, from ranges that contain every outcome."""
    rng = np.random.default_rng(2611)
    scenarios = []
    for seed in range(SCENARIOS):
        extra = []
        controller = str(rng.choice(["belief", "pd", OFF]))
        if rng.random() < 0.2:
            extra.append(f"cell.simulated.mass_kg={rng.uniform(0.01, 2.5):.3f}")
        if controller == "belief" and rng.random() < 0.4:  # The others refuse a limit of the force.
            extra.append(f"task.fragile_n={rng.uniform(1.0, 6.0):.2f}")
        fault = str(rng.choice(FAULTS))
        if fault:
            extra.append(f'faults=[{{backend="{fault}", at="lift"}}]')
        limits = Limits(
            slip_m=float(rng.choice([Limits().slip_m, 0.001])), peak=float(rng.choice([Limits().peak, 1.3]))
        )
        planned = Lift(
            controller,
            str(rng.choice(OBJECTS)),
            float(rng.choice([0.6, 1.0, 1.8])),
            float(rng.choice([0.03, 0.1])),
            float(rng.choice([0.5, 1.0])),
            str(rng.choice(["none", "brisk", "shove"])),
            seed,
            3.0,
            settings=(*QUICK, *limits.overrides(), *extra),
        )
        scenarios.append((planned, limits))
    return scenarios


@pytest.fixture(scope="module")
def judged():
    """The words of all verdicts, which show that the scenarios are not all alike."""
    counted: Counter[str] = Counter()
    yield counted
    if sum(counted.values()) == SCENARIOS:  # not with a selection
        assert len(counted) >= 5, counted


@pytest.mark.parametrize("number", range(SCENARIOS))
def test_one_scenario_has_one_verdict(tmp_path, judged, number):
    planned, limits = drawn()[number]
    overrides = planned.overrides()
    file = tmp_path / "run.json"
    code = main(["run", *(word for text in overrides for word in ("--set", text)), "--no-plot", "--json", str(file)])
    verdict = json.loads(file.read_text())["verdict"]
    assert code == verdict["exit_code"]
    judged[verdict["outcome"]] += 1
    in_grip = lift(planned)
    case = run_case(replace(Case("belief", "fused", planned.seed), settings=tuple(overrides)))
    margins = run_scenario(({}, limits, tuple(overrides)))
    assert {in_grip["sentence"], case["sentence"], margins["sentence"]} == {verdict["sentence"]}
    assert case["outcome"] == in_grip["outcome"] == margins["outcome"]
    fails = min(margins["margins"].values()) < 0
    assert fails == (verdict["outcome"] in FAILURES)
