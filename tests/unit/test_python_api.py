"""One line of Python: devices, own algorithms and tables without packaging; texts that fit a notebook."""

from __future__ import annotations

import subprocess
import sys

import pytest
from pydantic import BaseModel

import lsds
from lsds.contracts import Detection
from lsds.errors import ConfigError, PluginError
from lsds.registry import in_program
from lsds.registry.host import PluginHost

FAST = ["task.lift_s=0.3", "task.hold_s=0.2", "cell.simulated.fidelity=winkler"]
TWO = ["sensors.left.backend=mock-gelsight-mini", "sensors.right.backend=mock-gelsight-mini"]


class Mine:
    """A detector that calls every frame slip."""

    def __init__(self):
        self.seen = 0

    def reset(self):
        self.seen = 0

    def update(self, observation):
        self.seen += 1
        return Detection(True, 1.0, 0.5, 1.0)


@pytest.fixture
def registered():
    names = []

    def add(kind, name, *more, **fields):
        lsds.register(kind, name, *more, **fields)
        names.append((kind, name))

    yield add
    for name in names:
        in_program.unregister(*name)


def test_an_object_takes_the_place_of_the_detector():
    mine, cycles = Mine(), []
    session = lsds.run(overrides=FAST, detector=mine, observe=cycles.append)
    assert session.fault is None
    assert mine.seen == len(cycles) > 20
    assert all(cycle.detection.slip for cycle in cycles)
    assert "given" not in PluginHost().names("detector")


def test_a_class_is_built_for_each_finger_and_an_object_is_not_shared():
    made = []

    class Counted(Mine):
        def __init__(self):
            super().__init__()
            made.append(self)

    lsds.run(overrides=[*FAST, *TWO], detector=Counted)
    assert len(made) == 2
    assert all(own.seen > 20 for own in made)
    with pytest.raises(ConfigError, match="2 fingers would share one object"):
        lsds.run(overrides=[*FAST, *TWO], detector=Mine())


def test_a_registered_backend_is_chosen_by_name(registered):
    class Options(BaseModel):
        level: float = 1.0

    built = []

    def make(options, context):
        built.append(options.level)
        return Mine()

    registered("detector", "mine", make, Options)
    session = lsds.run(overrides=[*FAST, "detector.backend=mine", "detector.mine.level=2.5"])
    assert session.fault is None
    assert built == [2.5]
    with pytest.raises(ConfigError, match="level"):
        lsds.run(overrides=[*FAST, "detector.backend=mine", "detector.mine.level=high"])


def test_registering_again_replaces(registered):
    registered("detector", "mine", Mine)
    registered("detector", "mine", lambda: Mine())
    assert [b.distribution for b in PluginHost().backends if b.spec.name == "mine"] == ["program"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("detektor", "mine", Mine), "no kind 'detektor'"),
        (("detector", "mine", Mine()), "cannot be called"),
        (("detector", "a:b", Mine), "cannot be a name"),
        (("detector", "", Mine), "cannot be a name"),
    ],
)
def test_what_cannot_be_registered_is_refused(arguments, message):
    with pytest.raises(PluginError, match=message):
        lsds.register(*arguments)


def test_one_device_is_opened_and_closed():
    with lsds.open("gripper", "mock-hand-e") as gripper:
        assert gripper.read().aperture_m == pytest.approx(gripper.spec.stroke_m, abs=1e-3)
    assert gripper.lifecycle.name == "CLOSED"
    with pytest.raises(PluginError, match="no kind of device"), lsds.open("detector", "fused"):
        pass
    with pytest.raises(ConfigError, match="latncy_ms"), lsds.open("gripper", "mock-hand-e", latncy_ms=1.0):
        pass


def test_a_run_is_a_table():
    pytest.importorskip("pandas", reason="needs the extra data")
    session = lsds.run(overrides=FAST)
    table = session.frame()
    assert len(table) == session.summary["cycles"]
    assert table["t_s"].iloc[0] == 0
    assert {"speed_m_s", "load_n", "stage", "slip_probability"} <= set(table.columns)


def test_texts_fit_a_notebook():
    cycles = []
    session = lsds.run(overrides=FAST, observe=cycles.append)
    cycle = cycles[-1]
    finger = cycle.fingers[0]
    shown = [
        session,
        cycle,
        finger,
        finger.frame,
        finger.tracks,
        finger.observation,
        finger.observation.field,
        cycle.grip,
    ]
    assert {type(value).__name__: len(repr(value)) for value in shown if len(repr(value)) > 1200} == {}
    assert "uint8[240, 320, 3]" in repr(finger.frame)
    assert "held" in repr(session) or "dropped" in repr(session)


def test_the_module_is_the_command():
    found = subprocess.run([sys.executable, "-m", "lsds", "--version"], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == f"lsds, version {lsds.__version__}"
