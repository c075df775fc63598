"""Faults of the catalogue in a running cell: each is stopped with a name, or does no harm."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from lsds_mocks.faults.catalogue import CATALOGUE

from lsds.cli.faults import faults_override
from lsds.clock import VirtualClock
from lsds.config import load_config
from lsds.contracts import BuildContext, Frame
from lsds.contracts.stages import Stages, shared_stages
from lsds.errors import ConfigError, StaleData
from lsds.registry.host import PluginHost
from lsds.session.run import run

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Numbered:
    """A command that is known by its number."""

    number: int
    expires_ns: int = 0


SHORT = ("task.lift_s=0.6", "task.hold_s=0.3")


def with_fault(name, moment="take up", **keys):
    options = "".join(f", {key} = {value}" for key, value in keys.items())
    return run(None, [*SHORT, f'faults=[{{backend = "{name}", at = "{moment}"{options}}}]'])


@pytest.mark.parametrize(
    ("name", "keys", "message"),
    [
        ("gripper-stuck", {}, "commanded to .* it stays at"),
        ("gripper-offset", {"severity": 4}, "its fingers opened from .* no command asked for it"),
        ("gripper-coarse", {"severity": 5, "moment": "lift"}, "wider by more than its resolution"),
        ("gripper-coarse", {"severity": 3, "moment": "slip"}, "wider by more than its resolution"),
        ("gripper-lies", {"moment": "slip"}, r"closed by \d\.\d\d mm, but the normal force on the gel changed by"),
        ("camera-stuck-dots", {"severity": 5, "moment": "slip"}, "sensor: 82 % of the image has repeated for 0.2"),
        ("detector-none", {}, r"detector 'fused', frame \d+: update\(\) returned NoneType, not Detection"),
        ("tracker-nan", {}, r"tracker 'lk', frame \d+: a valid marker has no finite position"),
        ("controller-wrong", {}, r"controller 'belief': update\(\) returned str"),
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


def test_a_fault_begins_and_ends_as_configured():
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


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["arm.backend=none", 'faults=[{backend = "arm-slow"}]'], r"faults\.0\.backend: .* fault of the arm, .* none"),
        (['faults=[{backend = "arm-slow", finger = "finger"}]'], r"faults\.0\.finger: .* no fault of a finger"),
        (['faults=[{backend = "observer-raises", finger = "finger"}]'], r"faults\.0\.finger"),
        (['faults=[{backend = "none"}]'], r"faults\.0\.backend: 'none' is no fault \(leave the table out\)"),
    ],
)
def test_a_fault_that_cannot_take_effect_is_an_error(overrides, message):
    with pytest.raises(ConfigError, match=message):
        run(None, overrides)


def test_faults_of_the_command_line_come_to_those_of_the_file(tmp_path):
    file = tmp_path / "rig.toml"
    file.write_text('[[faults]]\nbackend = "arm-slow"\nseverity = 1\n')
    (override,) = faults_override(["lsds-mocks:camera-noise:5@lift", "gripper-stuck"], file)
    config = load_config(file, [override])
    assert [fault.backend for fault in config.faults] == ["arm-slow", "lsds-mocks:camera-noise", "gripper-stuck"]
    assert [fault.options() for fault in config.faults] == [{"severity": 1}, {"severity": 5, "at": "lift"}, {}]
    assert faults_override([], file) == []
    with pytest.raises(ConfigError, match="is not NAME"):
        faults_override(["camera-noise@"])


def test_two_faults_of_one_name_are_two_faults():
    never = '{backend = "observer-raises", at = "never"}'
    session = run(None, [*SHORT, f"faults=[{never}, {never}]"])
    assert session.fault is None
    assert session.summary["faults"] == 2 * [{"backend": "observer-raises", "moment": "never", "began_s": None}]
    context = BuildContext(VirtualClock(), 3)
    first, second = (PluginHost().build("fault", "camera-noise", {}, context).plan for _ in range(2))
    assert first.rng.random() != second.rng.random()


class Source:
    """A camera whose frames are their numbers."""

    def __init__(self):
        self.frame = None

    def read(self):
        return self.frame


def test_frames_that_change_places_all_come_each_with_its_own_time():
    context = BuildContext(VirtualClock(), 0)
    shared_stages(context).enter("start", 0)
    source = Source()
    camera = PluginHost().build("fault", "camera-swaps", {"severity": 5}, context).around(source)
    image, seen = np.zeros((2, 2, 3), np.uint8), []
    source.frame = Frame(image, 0, -1)
    for seq in range(6):
        source.frame = Frame(image, seq * 10, seq)
        for _ in range(3):
            try:
                frame = camera.read()
            except StaleData:
                continue
            if not seen or seen[-1] != (frame.seq, frame.t_ns):
                seen.append((frame.seq, frame.t_ns))
    assert seen == [(0, 10), (1, 0), (2, 30), (3, 20), (4, 50), (5, 40)]


@pytest.mark.parametrize("name", ["gripper-late", "arm-lags"])
def test_a_command_delayed_by_a_fault_never_arrives_after_a_newer_one(name):
    context = BuildContext(VirtualClock(), 0)
    shared_stages(context).enter("start", 0)
    taken = []

    class Device:
        def read(self):
            return None

        def command(self, command):
            taken.append(command.number)
            return command

    device = PluginHost().build("fault", name, {"severity": 5, "for_s": 0.1}, context).around(Device())
    for number, t_s in enumerate((0.0, 0.05, 0.2, 0.8)):
        context.clock.sleep_until(int(t_s * 1e9))
        device.command(Numbered(number))
        device.read()
    context.clock.sleep_until(2 * 10**9)
    device.read()
    assert taken == [2, 3]


def test_every_fault_of_the_catalogue_can_be_built_and_names_its_target():
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


def test_lost_markers_do_not_close_the_fingers_step_by_step():
    """With half of the markers lost, some frames give no load. That is no evidence of a slide."""
    lost = '[{backend = "tracker-loses", at = "slip", severity = 3}]'
    keys = ["task.lift_s=1.2", "task.hold_s=0.8", "seed=10", "sensor.mock-gelsight-mini.gel=10"]
    plain, faulty = run(None, keys), run(None, [*keys, f"faults={lost}"])
    peaks_n = [max(truth.normal_force_n for truth in session.truths) for session in (plain, faulty)]
    assert not faulty.truths[-1].dropped
    # Before, it was 6 times as much.
    assert peaks_n[1] < 2 * peaks_n[0]
