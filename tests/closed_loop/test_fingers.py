"""Two fingers in one rig: each has its own perception and detector; estimate and controller combine both."""

from __future__ import annotations

import pytest

import lsds
from lsds.contracts import Frame
from lsds.errors import ConfigError, SafetyStop

pytestmark = pytest.mark.usefixtures("installed_host")
BOTH = (
    "cell.simulated.fidelity=winkler",
    "task.lift_s=1.5",
    "sensors.left.backend=mock-gelsight-mini",
    "sensors.right.backend=mock-gelsight-mini",
    "sensors.right.mock-gelsight-mini.finger=right",
)


def test_both_fingers_hold_the_pipe_and_each_cycle_has_the_results_of_both():
    cycles = []
    session = lsds.run(overrides=BOTH, observe=cycles.append)
    assert session.summary["outcome"] == "held"
    names = [tuple(finger.finger for finger in cycle.fingers) for cycle in cycles]
    assert {name for seen in names for name in seen} == {"left", "right"}
    left, right = ([f for c in cycles for f in c.fingers if f.finger == name] for name in ("left", "right"))
    assert abs(len(left) - len(right)) <= 2
    assert not left[0].opposite
    assert right[0].opposite
    # The object goes down in the plane of both; noise and dots are each finger's own.
    assert any((a.frame.image != b.frame.image).any() for a, b in zip(left, right, strict=False))
    assert any(cycle.detection.slip for cycle in cycles if cycle.command_m is not None)


def test_a_run_with_two_fingers_is_bit_identical_by_seed():
    one, two = (lsds.run(overrides=[*BOTH, "task.lift_s=0.6"]) for _ in range(2))
    assert repr(one.record.samples) == repr(two.record.samples)


def test_the_controller_sees_both_fingers():
    seen = []
    with lsds.bring_up(overrides=BOTH) as engine:
        update = engine.rig.controller.update

        def updating(grip, wanted):
            seen.append(grip)
            return update(grip, wanted)

        engine.rig.controller.update = updating
        for _ in engine:
            if len(seen) > 5:
                break
    assert all({finger.finger for finger in grip.fingers} == {"left", "right"} for grip in seen[2:])


@pytest.mark.parametrize("name", ["left", "right"])
def test_a_finger_without_usable_frames_stops_the_cell_and_is_named(name):
    with lsds.bring_up(overrides=BOTH) as engine:
        finger = next(finger for finger in engine.rig.fingers if finger.name == name)
        read = finger.sensor.read

        def reading():
            frame = read()
            return frame if frame.seq < 60 else Frame(0 * frame.image, frame.t_ns, frame.seq)

        finger.sensor.read = reading
        with pytest.raises(SafetyStop, match=f"sensor {name}: nothing usable.*black"):
            engine.run()


def test_a_finger_is_mirrored_if_the_config_sets_opposite():
    with lsds.bring_up(overrides=[*BOTH, "sensors.left.opposite=true", "sensors.right.opposite=false"]) as engine:
        assert [finger.opposite for finger in engine.rig.fingers] == [True, False]


def test_one_finger_or_several_but_not_both():
    with pytest.raises(ConfigError, match="cannot be used together"):
        lsds.load_config(None, ["sensor.backend=mock-gelsight-mini", "sensors.left.backend=mock-gelsight-mini"])
    with pytest.raises(ConfigError, match=r"sensors.left.backend: unknown backend 'mock-gelsight-mine'"):
        lsds.load_config(None, ["sensors.left.backend=mock-gelsight-mine"])
    with pytest.raises(ConfigError, match=r"sensors.left.mock-gelsight-mini.nois: unknown key \(did you mean 'noise'"):
        lsds.load_config(None, ["sensors.left.mock-gelsight-mini.nois=1"])
