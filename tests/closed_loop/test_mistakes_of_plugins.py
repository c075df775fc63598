"""A plugin that ends the program, answers with something else or raises: one error that names it, and no opening."""

from __future__ import annotations

import json
import math
import pickle
import sys
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from lsds_mocks.devices.hand_e import MockHandE

import lsds
from lsds.cli.run import run as run_command
from lsds.contracts import Detection
from lsds.errors import CallHangs, ConfigError, ConfigIssue, ConnectionLost, PluginError
from lsds.registry.in_program import unregister

FAST = ("task.lift_s=0.3", "task.hold_s=0.3", "cell.simulated.fidelity=winkler")


class Detector:
    """Reports rest, and does something at a frame."""

    def __init__(self, act=lambda: None, at=40):
        self.count, self.act, self.at = 0, act, at

    def reset(self):
        pass

    def update(self, observation):
        self.count += 1
        if self.count >= self.at:
            self.act()
        return Detection(False, 0.0, 0.5, 1.0)


REAL = {name: getattr(MockHandE, name) for name in ("read", "command", "close")}


@pytest.fixture
def with_gripper(monkeypatch):
    """Run with other methods of the gripper."""

    def run(**methods):
        with monkeypatch.context() as patch:
            for name, method in methods.items():
                patch.setattr(MockHandE, name, method, raising=False)
            return lsds.run(None, FAST)

    return run


@pytest.mark.parametrize("code", [0, 3])
def test_a_detector_that_ends_the_program_ends_the_run(code):
    session = lsds.run(None, FAST, detector=Detector(lambda: sys.exit(code)))
    assert isinstance(session.fault, PluginError)
    assert rf"ended the program in update(): sys.exit({code})" in str(session.fault)
    assert "detector 'given-" in str(session.fault)
    apertures = [sample.held_m for sample in session.record.samples if math.isfinite(sample.held_m)]
    assert apertures[-1] <= min(apertures) + 1e-9


def test_a_reset_that_ends_the_program_ends_the_run():
    detector = Detector()
    detector.reset = lambda: sys.exit(6)
    session = lsds.run(None, FAST, detector=detector)
    assert "ended the program in reset(): sys.exit(6)" in str(session.fault)


def test_an_error_that_was_handled_is_not_blamed_for_a_later_one(with_gripper):
    def read(self):
        state = REAL["read"](self)
        return replace(state, aperture_m=None) if self._spoiled() else state

    session = with_gripper(read=read, _spoiled=after(200))
    assert str(session.fault).startswith("gripper 'mock-hand-e': read() returned GripperState(")


def test_a_scenario_whose_plugin_ends_the_program_is_one_of_many():
    lsds.register("detector", "leaver", lambda: Detector(lambda: sys.exit(0)))
    try:
        results = list(lsds.simulate([[*FAST, "detector.backend=leaver"], list(FAST)]))
    finally:
        unregister("detector", "leaver")
    assert results[0].verdict.outcome == "stopped"
    assert results[1].verdict.outcome == "held"


def test_a_gripper_that_raises_is_named(with_gripper):
    def read(self):
        if self._spoiled():
            raise ValueError("bad frame")
        return REAL["read"](self)

    session = with_gripper(read=read, _spoiled=after(200))
    assert str(session.fault).startswith("gripper 'mock-hand-e' in read() raised ValueError: bad frame")


def test_a_gripper_that_answers_with_something_else_is_named(with_gripper):
    def command(self, command):
        REAL["command"](self, command)

    session = with_gripper(command=command)
    assert "gripper 'mock-hand-e': command() returned NoneType, not GripperCommand" in str(session.fault)
    session = with_gripper(read=lambda self: 0.05)
    assert "gripper 'mock-hand-e': read() returned float, not GripperState" in str(session.fault)


def test_apertures_that_are_not_finite_are_no_states(with_gripper):
    def read(self):
        state = REAL["read"](self)
        return replace(state, aperture_m=math.nan) if self._spoiled() else state

    session = with_gripper(read=read, _spoiled=after(200))
    assert str(session.fault).startswith("gripper: nothing usable for")
    assert "its aperture is nan m" in str(session.fault)


def test_a_gripper_that_does_not_close_is_named(with_gripper):
    def close(self):
        REAL["close"](self)
        raise RuntimeError("boom")

    session = with_gripper(close=close)
    assert session.verdict.outcome == "held"
    assert [str(error) for error in session.fault.exceptions] == [
        "gripper 'mock-hand-e' raised RuntimeError at close(): boom (a bug in that plugin; lsds --debug shows where)"
    ]


def after(calls):
    """Return a method that is true from a number of calls on."""

    def spoiled(self):
        self.calls = getattr(self, "calls", 0) + 1
        return self.calls > calls

    return spoiled


def test_what_a_plugin_prints_does_not_spoil_the_json():
    lsds.register("detector", "talker", lambda: Detector(lambda: print("debug line")))
    try:
        settings = [text for each in (*FAST, "detector.backend=talker") for text in ("--set", each)]
        result = CliRunner().invoke(run_command, [*settings, "--no-plot", "--json", "-"])
    finally:
        unregister("detector", "talker")
    assert json.loads(result.stdout)["verdict"]["outcome"] == "held"
    assert "debug line" in result.stderr


def test_overrides_change_a_configuration_too():
    config = lsds.load_config(None, FAST)
    for overrides in (["task.lift_s=0.6"], "task.lift_s=0.6", {"task.lift_s": 0.6}):
        longer = lsds.run(config, overrides).summary["simulated_s"] - lsds.run(config).summary["simulated_s"]
        assert longer == pytest.approx(0.3, abs=0.1)
    with pytest.raises(ConfigError, match="unknown key"):
        lsds.run(config, ["task.lift=1"])
    with pytest.raises(ConfigError, match="load the file with this override"):
        lsds.run(config, ['calibration=["slip.toml"]'])
    with pytest.raises(ConfigError, match="TOML cannot hold a NoneType"):
        lsds.run(config, {"task.lift_s": None})
    for wrong in (5, [("task.lift_s", 1)]):
        with pytest.raises(ConfigError, match="give texts such as"):
            lsds.run(config, wrong)


def test_a_mapping_is_a_configuration():
    session = lsds.run({"task.lift_s": np.float64(0.3), "task.hold_s": 0.3, "cell.simulated.fidelity": "winkler"})
    assert session.verdict.outcome == "held"


def test_a_class_is_no_job():
    with pytest.raises(PluginError, match=r"job is the class HoldJob; give an object: HoldJob\(\)"):
        lsds.run(None, FAST, job=lsds.HoldJob)


@pytest.mark.parametrize(
    "error",
    [
        ConfigError("rig.toml", [ConfigIssue("task.lift_s", "is missing", line=3)]),
        ConnectionLost("gripper 'hand-e'", "does not answer", remedy="check the cable", code=7),
        CallHangs("detector 'own'", "update", 5.0, key="deadlines.update_s"),
        PluginError("boom"),
    ],
)
def test_errors_can_be_sent_to_another_process(error):
    error.add_note("while closing the rig")
    sent = pickle.loads(pickle.dumps(error))
    assert (type(sent), str(sent), sent.__dict__) == (type(error), str(error), error.__dict__)


def test_a_session_can_be_sent_to_another_process():
    session = lsds.run(None, FAST)
    sent = pickle.loads(pickle.dumps(session))
    assert sent.summary["slip_distance_m"] == session.summary["slip_distance_m"]
    assert len(sent.record.samples) == len(session.record.samples)
