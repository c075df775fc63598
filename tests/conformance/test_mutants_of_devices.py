"""Every mistake is found by its check, with a remedy, and an honest device passes all of them."""

from __future__ import annotations

import mutants_lives
import mutants_movers
import mutants_sensors
import pytest
from catching import CAUGHT_DEVICES
from fake_cell import plugin
from honest_devices import HonestArm, HonestGripper, HonestPoses, HonestSensor

from lsds.contracts import BackendSpec
from lsds.registry import PluginHost
from lsds.testing import Bench, cases
from lsds.testing.option_keys import OPTION_CHECKS
from lsds.testing.tables import name_of

MODULES = (mutants_lives, mutants_sensors, mutants_movers)
HONEST = {"sensor": HonestSensor, "gripper": HonestGripper, "arm": HonestArm, "pose_source": HonestPoses}


def unplug(device):
    device.unplugged = True


def bench(kind, device):
    host = PluginHost(entry_points=[])
    name = device.__name__.lower()
    spec = BackendSpec(kind, name, f"{device.__module__}:{device.__name__}", virtual_time=True, in_cell=True)
    host.register(plugin(spec), distribution="mutants", name="mutants")
    return Bench(kind, name, host=host, unplug=unplug)


HONEST_CASES = [case for kind, device in HONEST.items() for case in cases(bench(kind, device))]


@pytest.mark.parametrize("case", HONEST_CASES, ids=lambda case: case.id)
def test_an_honest_device_passes(case):
    result = case.run()
    assert result.outcome == "passed", result


@pytest.mark.parametrize("mutant", CAUGHT_DEVICES, ids=lambda mutant: mutant.__name__)
def test_a_mutant_is_caught_by_the_check_of_its_mistake(mutant):
    kind, check, match = CAUGHT_DEVICES[mutant]
    (case,) = [case for case in cases(bench(kind, mutant)) if case.check is check]
    with pytest.raises(AssertionError, match=match) as caught:
        case()
    message = str(caught.value)
    assert "\nrule: " in message
    assert "\nguide: docs/plugins.md#" in message


def test_mutants_are_registered():
    assert {mutant.__module__ for mutant in CAUGHT_DEVICES} == {module.__name__ for module in MODULES}
    assert len(CAUGHT_DEVICES) > 80


def test_every_check_catches_a_mutant():
    checks = {name_of(case.check) for case in HONEST_CASES if case.check not in OPTION_CHECKS}
    assert checks == {name_of(check) for _, check, _ in CAUGHT_DEVICES.values()}
