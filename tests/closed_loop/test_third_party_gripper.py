"""A gripper of another distribution, with its own dynamics, joins the cell by the public interface and lifts."""

from __future__ import annotations

import math

import pytest
from fake_cell import plugin
from installed import installed_host
from pydantic import BaseModel, ConfigDict

from lsds.config import check_config
from lsds.contracts import BackendSpec, Contact, GripperCommand, GripperSpec, GripperState, Lifecycle
from lsds.contracts.lifecycle import LifecycleGuard
from lsds.contracts.plant import join
from lsds.errors import CommandExpired, ConfigError, LimitExceeded
from lsds.runtime.engine import Engine
from lsds.runtime.rig import Rig
from lsds.testing import Bench, cases

pytestmark = pytest.mark.usefixtures("installed_host")
SPEC = GripperSpec(stroke_m=0.08, resolution_m=2e-4, speed_m_s=(0.001, 0.02), force_n=(5.0, 80.0))
CYCLE_NS = 10_000_000


class Jaws:
    """A drive with a time constant: slower at the end of a motion than the one of the cell."""

    def __init__(self):
        self.aperture_m = self.target_m = SPEC.stroke_m
        self.speed_m_s, self.limit_n = SPEC.speed_m_s[1], SPEC.force_n[1]
        self.moving = self.stalled = False

    def step(self, dt_s, force_n):
        left = self.target_m - self.aperture_m
        self.stalled = left < 0 and force_n >= self.limit_n
        self.moving = abs(left) > 1e-6 and not self.stalled
        if self.moving:
            speed = min(self.speed_m_s, max(abs(left) / 0.03, 1e-4))
            self.aperture_m += math.copysign(min(speed * dt_s, abs(left)), left)


class Options(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class AcmeWide:
    spec = SPEC

    def __init__(self, options, context):
        self.clock, self.plant, self.jaws = context.clock, join(context), Jaws()
        self.plant.use_fingers(self.jaws)
        self.guard = LifecycleGuard("acme-wide")
        self.connected_ns = self.stops = 0

    @property
    def lifecycle(self):
        return self.guard.state

    def connect(self):
        with self.guard.connecting():
            self.connected_ns = self.clock.now()

    def arm(self):
        with self.guard.arming():
            pass

    def stop(self):
        if self.guard.state in (Lifecycle.CONNECTED, Lifecycle.ARMED):
            self.stops += 1
            self.plant.post(self.clock.now(), "acme-wide", self._hold)

    def disarm(self):
        with self.guard.disarming() as armed:
            if armed:
                self.stop()

    def close(self):
        with self.guard.closing():
            pass

    def read(self):
        self.guard.require_readable()
        now = self.clock.now()
        self.plant.advance(now)
        at = self.plant.moment(now - now % CYCLE_NS)
        contact = Contact.CLOSING if at.stalled else Contact.NONE
        seq = max(0, now // CYCLE_NS - self.connected_ns // CYCLE_NS)
        return GripperState(at.t_ns, seq, at.aperture_m, at.target_m, at.moving, contact)

    def command(self, command):
        self.guard.require_armed()
        if not all(map(math.isfinite, (command.aperture_m, command.speed_m_s, command.force_n))):
            raise LimitExceeded("acme-wide", "not finite")
        now = self.clock.now()
        if now >= command.expires_ns:
            raise CommandExpired("acme-wide", "too late")
        tick = SPEC.resolution_m
        aperture = round(min(max(command.aperture_m, 0.0), SPEC.stroke_m) / tick) * tick
        speed = min(max(command.speed_m_s, SPEC.speed_m_s[0]), SPEC.speed_m_s[1])
        force = min(max(command.force_n, SPEC.force_n[0]), SPEC.force_n[1])
        stops = self.stops

        def go(motion):
            if self.stops == stops:
                self.jaws.target_m, self.jaws.speed_m_s, self.jaws.limit_n = aperture, speed, force

        self.plant.post(now + 12_000_000, "acme-wide", go)
        return GripperCommand(aperture, speed, force, command.expires_ns)

    def _hold(self, motion):
        self.jaws.target_m = self.jaws.aperture_m


def spec(name, **more):
    return BackendSpec(
        "gripper", name, f"{__name__}:AcmeWide", f"{__name__}:Options", **{"virtual_time": True, "in_cell": True} | more
    )


@pytest.fixture
def acme_host():
    host = installed_host()
    host.register(plugin(spec("acme-wide"), spec("acme-outside", in_cell=False)), distribution="acme")
    return host


def test_it_lifts_and_holds(acme_host):
    raw = {"seed": 3, "gripper": {"backend": "acme-wide"}, "task": {"lift_s": 1.5}}
    with Rig(check_config(raw, "test", acme_host), acme_host) as rig:
        rig.arm_devices()
        assert rig.gripper.plant is rig.cell
        assert rig.gripper.read().aperture_m == pytest.approx(0.08)
        Engine(rig, rig.job).run()
        truth = rig.cell.truth()
    assert not truth.dropped
    assert not truth.supported
    assert truth.object_height_m > 0.03
    assert truth.slip_distance_m < 0.010
    assert truth.normal_force_n > truth.required_normal_force_n


def test_it_passes_the_kit(acme_host):
    for case in cases(Bench("gripper", "acme-wide", host=acme_host)):
        case()


def test_outside_the_cell_it_is_refused_by_name(acme_host):
    config = check_config({"gripper": {"backend": "acme-outside"}}, "test", acme_host)
    expected = "gripper 'acme-outside' is not part of the simulated cell that sensor 'mock-gelsight-mini' is in"
    with pytest.raises(ConfigError, match=expected):
        Rig(config, acme_host)
