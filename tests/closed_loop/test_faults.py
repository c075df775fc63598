"""Faults of the catalogue in a running cell: each is stopped with a name, or does no harm."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from lsds_mocks.faults.catalogue import CATALOGUE

from lsds.clock import VirtualClock
from lsds.config import load_config
from lsds.contracts import BuildContext
from lsds.errors import ConfigError
from lsds.plugins.host import PluginHost
from lsds.session.run import run
from lsds.stages import Stages, shared_stages

ROOT = Path(__file__).resolve().parents[2]
SHORT = ("task.lift_s=0.6", "task.hold_s=0.3")


def with_fault(name, moment="take up", **keys):
    told = "".join(f", {key} = {value}" for key, value in keys.items())
    return run(None, [*SHORT, f'faults=[{{backend = "{name}", at = "{moment}"{told}}}]'])


@pytest.mark.parametrize(
    ("name", "keys", "message"),
    [
        ("gripper-stuck", {}, "told to close to .* it rests at"),
        ("gripper-offset", {"severity": 4}, "its fingers opened from .* nothing told them to"),
        ("gripper-coarse", {"severity": 5, "moment": "lift"}, "wider than its resolution explains"),
        ("detector-none", {}, r"detector 'fused', frame \d+: update\(\) returned NoneType, not Detection"),
        ("tracker-nan", {}, r"tracker 'lk', frame \d+: a marker that is valid has no position"),
        ("controller-wrong", {}, r"controller 'margin': update\(\) returned str"),
        ("camera-frozen", {}, r"sensor: nothing usable for 0\.2"),
        ("arm-protective-stop", {}, "protective stop"),
        ("observer-disk-full", {}, "an observer of the run failed: OSError"),
    ],
)
def test_a_fault_ends_the_run_with_a_name(name, keys, message):
    session = with_fault(name, **keys)
    assert session.summary["outcome"] == "fault"
    assert re.search(message, session.summary["fault"])
    assert not session.truths[-1].dropped


def test_a_fault_that_has_not_begun_changes_nothing():
    """All parts are wrapped, and the run is that without them, bit by bit."""
    parts = (
        "camera-noise",
        "camera-late",
        "gripper-late",
        "arm-lags",
        "tracker-loses",
        "detector-late",
        "controller-late",
    )
    never = ", ".join(f'{{backend = "{name}", at = "never"}}' for name in parts)
    plain, wrapped = run(None, SHORT), run(None, [*SHORT, f"faults=[{never}]"])
    assert plain.record.samples == wrapped.record.samples
    assert plain.truths == wrapped.truths


def test_a_fault_begins_and_ends_when_it_was_told_to():
    context = BuildContext(VirtualClock(), 3)
    host, stages = PluginHost(), shared_stages(context)
    options = {"at": "lift", "after_s": 0.5, "for_s": 1.0, "severity": 5}
    plan = host.build("fault", "camera-noise", options, context).plan
    seen = []
    for t in (0, 1, 2, 3):
        context.clock.sleep_until(t * 10**9)
        stages.enter("lift" if t else "settle", context.clock.now())
        seen.append(plan.on)
    assert seen == [False, False, True, False]
    assert plan.level == 50


def test_a_stage_began_when_it_was_first_entered():
    stages = Stages()
    for t, stage in enumerate(("lift", "hold", "lift")):
        stages.enter(stage, t)
    assert (stages.began_ns("lift"), stages.began_ns("hold"), stages.began_ns("slip")) == (0, 1, None)


@pytest.mark.parametrize(
    ("faults", "message"),
    [
        ('[{backend = "camera-nois"}]', r"faults\.0\.backend: unknown backend 'camera-nois' .*'camera-noise'"),
        ('[{backend = "camera-noise", severity = 9}]', r"faults\.0\.severity"),
        ('[{backend = "camera-noise", sevrity = 2}]', r"faults\.0\.sevrity"),
        ("[{severity = 2}]", r"faults\.0\.backend"),
        ("7", "faults"),
    ],
)
def test_a_wrong_fault_is_an_error_that_names_its_place(faults, message):
    with pytest.raises(ConfigError, match=message):
        load_config(None, [f"faults={faults}"])


def test_a_fault_of_a_finger_that_there_is_not_is_an_error():
    with pytest.raises(ConfigError, match=r"faults\.0\.finger: no finger 'left' \(there are finger\)"):
        run(None, ['faults=[{backend = "camera-dark", finger = "left"}]'])


def test_every_fault_of_the_catalogue_can_be_built_and_says_what_it_afflicts():
    host, context = PluginHost(), BuildContext(VirtualClock(), 0)
    kinds = {"sensor", "gripper", "arm", "tracker", "detector", "estimator", "controller", "observer"}
    for entry in CATALOGUE:
        built = host.build("fault", entry.name, {"severity": 5}, context)
        assert built.target in kinds, entry.name
        assert len(entry.levels) in (0, 5), entry.name
    assert {host.build("fault", entry.name, {}, context).target for entry in CATALOGUE} == kinds
    assert len({entry.name for entry in CATALOGUE}) == len(CATALOGUE) > 40


def test_the_page_of_faults_lists_the_catalogue():
    page = (ROOT / "docs" / "faults.md").read_text(encoding="utf-8")
    for entry in CATALOGUE:
        levels = ", ".join(f"{level:g}" for level in entry.levels) + f" {entry.unit}" if entry.levels else "-"
        assert f"| `{entry.name}` | {entry.summary} | {levels} |" in page
