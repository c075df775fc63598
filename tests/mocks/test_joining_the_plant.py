"""A device mock of another distribution joins the simulated cell through `lsds.contracts.plant` and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext
from lsds.contracts.plant import Plant, join
from lsds.errors import ConfigError, PluginNotFound
from lsds.registry import PluginHost

MS = 1_000_000


class Slow:
    """Fingers with 80 mm of stroke that close by 20 mm/s."""

    stalled = False

    def __init__(self):
        self.aperture_m = self.target_m = 0.08
        self.forces = []

    @property
    def moving(self):
        return self.aperture_m != self.target_m and not self.stalled

    def step(self, dt_s, force_n):
        self.forces.append(force_n)
        self.stalled = self.target_m < self.aperture_m and force_n >= 20.0
        if self.moving:
            way = self.target_m - self.aperture_m
            self.aperture_m += float(np.clip(way, -0.02 * dt_s, 0.02 * dt_s))


class Camera:
    def __init__(self):
        self.next_exposure_ns = 40 * MS
        self.seen = []

    def expose(self, touch):
        self.seen.append((self.next_exposure_ns, touch))
        self.next_exposure_ns += 40 * MS


@pytest.fixture
def context(installed_host):
    context = BuildContext(VirtualClock(), 1)
    installed_host.build("cell", "simulated", {"fidelity": "pad", "grid": 1}, context)
    return context


def test_all_devices_of_a_rig_join_one_plant(context, installed_host):
    plant = join(context)
    assert isinstance(plant, Plant)
    assert installed_host.build("gripper", "mock-hand-e", {}, context).cell is plant
    assert installed_host.build("arm", "mock-ur5e", {}, context).cell is plant
    assert installed_host.build("sensor", "mock-gelsight-mini", {}, context).cell is plant


def test_a_rig_that_names_no_cell_gets_the_default_one(installed_host):
    context = BuildContext(VirtualClock(), 1)
    gripper = installed_host.build("gripper", "mock-hand-e", {}, context)
    assert join(context) is gripper.cell


def test_without_a_cell_the_error_names_the_remedy(host, installed_host):
    with pytest.raises(ConfigError, match=r"cell.backend: .* there is no cell .*\[cell\] backend = \"simulated\""):
        join(BuildContext(VirtualClock()))
    context = BuildContext(VirtualClock())
    host.build("cell", "fake-cell", {}, context)
    with pytest.raises(ConfigError, match="FakeCell has no plant in this process"):
        join(context)
    with pytest.raises(ConfigError, match="FakeCell has no plant"):
        installed_host.build("sensor", "mock-gelsight-mini", {}, context)
    context = BuildContext(VirtualClock())
    host.build("gripper", "fake-gripper", {}, context)
    with pytest.raises(PluginNotFound, match="'simulated'"):
        join(context)


def test_own_fingers_feel_the_object_and_the_camera_sees_it(context):
    plant, fingers, camera = join(context), Slow(), Camera()
    plant.use_fingers(fingers)
    plant.watch(camera)
    assert plant.moment(0).aperture_m == 0.08
    rest = np.array([[x, y] for x in (-4e-3, 0.0, 4e-3) for y in (-4e-3, 0.0, 4e-3)])
    plant.post(10 * MS, "acme", lambda motion: setattr(fingers, "target_m", 0.0215))
    # The plant's own drive is replaced: commands to it change nothing.
    plant.post(11 * MS, "acme", lambda motion: motion.drive_fingers(0.01, 0.15, 60.0))
    plant.advance(3200 * MS)
    held = plant.moment(3200 * MS)
    assert held.aperture_m == fingers.aperture_m < 0.025
    assert held.normal_n == pytest.approx(fingers.forces[-1], rel=0.05)
    assert held.normal_n > 3.0
    plant.post(3200 * MS, "acme", lambda motion: motion.drive_arm(0.05, 0.5))
    plant.advance(3800 * MS)
    lifted = plant.moment(3800 * MS)
    assert lifted.tcp_pose.position_m[2] > held.tcp_pose.position_m[2] + 0.01
    assert lifted.tcp_twist.linear_m_s[2] == pytest.approx(0.05)
    first, last = camera.seen[0][1], camera.seen[-1][1]
    assert (first.normal_n, first.tangential_n, first.contact_fraction(0.01, 0.01)) == (0.0, (0.0, 0.0), 0.0)
    assert last.normal_n == pytest.approx(lifted.normal_n, rel=0.05)
    # The object hangs from two fingers; y is down.
    assert last.tangential_n[1] > 0.3
    assert last.displacement_m(rest)[4, 1] > 1e-5
    assert last.depth_m(np.zeros(1), np.zeros(1))[0, 0] > 1e-4
    assert 0 < last.contact_fraction(0.01, 0.01) <= 1
    plant.unwatch(camera)
    plant.advance(4000 * MS)
    assert camera.seen[-1][1] is last
    assert plant.touch().normal_n == pytest.approx(plant.moment(4000 * MS).normal_n)


def test_a_host_without_plugins_gives_no_cell():
    context = BuildContext(VirtualClock(), default_cell=lambda context: None)
    with pytest.raises(ConfigError, match=r"no plant|no cell"):
        join(context)
    assert PluginHost(entry_points=[]).backends == ()
