"""No grip is opened while gripper, arm or detector is silent, whatever the controller asks for."""

from __future__ import annotations

import pytest

import lsds
from lsds.contracts import Detection
from lsds.errors import SafetyStop, StaleData

SILENT_S, RECENT_S = 3.0, 0.06
QUICK = ["cell.simulated.fidelity=winkler", "task.grip_aperture_m=0.022", "task.lift_s=3.0"]


class Opens:
    """A controller that always opens a little."""

    may_open = True
    limits_force = False

    def update(self, grip, wanted):
        return grip.commanded_m + 2.5e-4

    def reset(self):
        pass


@pytest.mark.parametrize("kind", ["gripper", "arm"])
def test_a_release_ends_with_the_last_state(installed_host, kind):
    sent = []
    with lsds.bring_up(overrides=QUICK) as engine:
        rig = engine.rig
        rig.controller = Opens()
        engine._may_open = True
        device, begun = getattr(rig, kind), rig.clock.now()
        read, command = device.read, rig.gripper.command

        def now_s():
            return (rig.clock.now() - begun) * 1e-9

        def reading():
            if now_s() > SILENT_S:
                raise StaleData(kind, "unplugged")
            return read()

        def commanding(asked):
            sent.append((now_s(), asked.aperture_m))
            return command(asked)

        device.read, rig.gripper.command = reading, commanding
        with pytest.raises(SafetyStop, match=kind):
            engine.run()
    before = [aperture_m for at, aperture_m in sent if at < SILENT_S + RECENT_S]
    assert before[-1] > before[-5], "it opened until then"
    assert max((aperture_m for at, aperture_m in sent if at > SILENT_S + RECENT_S), default=0.0) <= before[-1]


class Abstains:
    """A detector that decides nothing from a frame on."""

    def __init__(self, after):
        self.left = after

    def update(self, observation):
        self.left -= 1
        return Detection(False, 0.0, 0.5, 1.0) if self.left > 0 else Detection(None, float("nan"), 0.5, 0.0)

    def reset(self):
        pass


def test_nothing_opens_on_an_abstention(installed_host):
    cycles = []
    lsds.run(None, QUICK, controller=Opens(), detector=Abstains(90), observe=cycles.append)
    acting = [cycle for cycle in cycles if cycle.acting]
    decided = [cycle.held_m for cycle in acting if cycle.detection.slip is False]
    abstained = [cycle.held_m for cycle in acting if cycle.detection.slip is None]
    assert decided[-1] > decided[0], "it opened until then"
    assert abstained
    assert max(abstained) <= decided[-1]
