"""Well-behaved fakes of every kind, registered on a host as a third party's plugin would be."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import (
    ArmCommand,
    ArmSpec,
    ArmState,
    BackendSpec,
    BuildContext,
    Frame,
    GripperCommand,
    GripperSpec,
    GripperState,
    Lifecycle,
    Pose,
    PoseSample,
    SensorSpec,
    Twist,
)
from lsds.contracts.lifecycle import LifecycleGuard
from lsds.errors import CommandExpired, ConnectFailed, LimitExceeded
from lsds.registry import PluginHost, hookimpl


class Options(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    latency_ms: float = Field(default=0.0, ge=0, le=1000, description="age of what is read")
    fail: str = Field(default="", description="which call fails")


class FakeDevice:
    """Life cycle alone; records its calls."""

    name = "fake"

    def __init__(self, options: Options, context: BuildContext) -> None:
        self.options = options
        self.clock = context.clock
        self.guard = LifecycleGuard(self.name)
        self.calls: list[str] = context.shared("calls", list)
        self.connected_ns = 0

    @property
    def lifecycle(self) -> Lifecycle:
        return self.guard.state

    def _call(self, call: str) -> None:
        self.calls.append(f"{self.name}.{call}")
        if self.options.fail == call:
            raise ConnectFailed(self.name, f"{call} did not work", remedy="switch it on", code=7)
        if self.options.fail == f"interrupt {call}":
            self.options = Options()
            raise KeyboardInterrupt

    def connect(self) -> None:
        with self.guard.connecting():
            self._call("connect")
            self.connected_ns = self.clock.now()

    def arm(self) -> None:
        with self.guard.arming():
            self._call("arm")

    def stop(self) -> None:
        self._call("stop")

    def disarm(self) -> None:
        with self.guard.disarming() as armed:
            if armed:
                self._call("disarm")

    def close(self) -> None:
        with self.guard.closing() as first:
            if first:
                self._call("close")

    def _sample(self, rate_hz: float) -> tuple[int, int]:
        self.guard.require_readable()
        seq = int((self.clock.now() - self.connected_ns) * rate_hz // 1_000_000_000)
        return self.connected_ns + math.ceil(seq * 1_000_000_000 / rate_hz), seq


class FakeSensor(FakeDevice):
    name = "fake-sensor"
    spec = SensorSpec(width_px=16, height_px=12, rate_hz=25.0, metres_per_px=5e-5)

    def read(self) -> Frame:
        t_ns, seq = self._sample(25.0)
        return Frame(np.full((12, 16, 3), seq % 256, np.uint8), t_ns, seq)


class FakeGripper(FakeDevice):
    name = "fake-gripper"
    spec = GripperSpec(stroke_m=0.05, resolution_m=1e-4, speed_m_s=(0.02, 0.15), force_n=(20.0, 130.0))

    def __init__(self, options: Options, context: BuildContext) -> None:
        super().__init__(options, context)
        self._start_m = self._target_m = self.spec.stroke_m
        self._start_ns = 0
        self._speed = 0.1

    def read(self) -> GripperState:
        t_ns, seq = self._sample(100.0)
        aperture = self._aperture(self.clock.now())
        return GripperState(t_ns, seq, aperture, self._target_m, moving=aperture != self._target_m)

    def _aperture(self, now: int) -> float:
        way = self._target_m - self._start_m
        return self._start_m + math.copysign(min(abs(way), self._speed * (now - self._start_ns) / 1e9), way)

    def command(self, command: GripperCommand) -> GripperCommand:
        self.guard.require_armed()
        if not all(map(math.isfinite, (command.aperture_m, command.speed_m_s, command.force_n))):
            raise LimitExceeded(self.name, "not finite")
        if command.expires_ns < self.clock.now():
            raise CommandExpired(self.name, "too late")
        now, spec = self.clock.now(), self.spec
        aperture = round(min(max(command.aperture_m, 0.0), spec.stroke_m) / spec.resolution_m) * spec.resolution_m
        self._start_m, self._start_ns = self._aperture(now), now
        self._target_m = aperture
        self._speed = min(max(command.speed_m_s, spec.speed_m_s[0]), spec.speed_m_s[1])
        force = min(max(command.force_n, spec.force_n[0]), spec.force_n[1])
        return GripperCommand(aperture, self._speed, force, command.expires_ns)

    def stop(self) -> None:
        super().stop()
        self._start_m = self._target_m = self._aperture(self.clock.now())


class FakeArm(FakeDevice):
    name = "fake-arm"
    spec = ArmSpec(speed_m_s=1.0, acceleration_m_s2=5.0, reach_m=0.85)

    def __init__(self, options: Options, context: BuildContext) -> None:
        super().__init__(options, context)
        self._z = self._speed = 0.0
        self._at_ns = 0
        self._expires_ns = 0

    def _advance(self) -> None:
        now = self.clock.now()
        end = min(now, max(self._expires_ns, self._at_ns))
        self._z += self._speed * (end - self._at_ns) / 1e9
        if now > end:
            self._speed = 0.0
        self._at_ns = now

    def read(self) -> ArmState:
        t_ns, seq = self._sample(125.0)
        self._advance()
        return ArmState(t_ns, seq, Pose((0.0, 0.0, self._z)), Twist((0.0, 0.0, self._speed)))

    def command(self, command: ArmCommand) -> ArmCommand:
        self.guard.require_armed()
        numbers = (*command.twist.linear_m_s, *command.twist.angular_rad_s, command.acceleration_m_s2)
        if not all(map(math.isfinite, numbers)):
            raise LimitExceeded(self.name, "not finite")
        if command.expires_ns < self.clock.now():
            raise CommandExpired(self.name, "too late")
        self._advance()
        limit = self.spec.speed_m_s
        self._speed = min(max(command.twist.linear_m_s[2], -limit), limit)
        self._expires_ns = command.expires_ns
        acceleration = min(command.acceleration_m_s2, self.spec.acceleration_m_s2)
        return ArmCommand(Twist((0.0, 0.0, self._speed)), acceleration, command.expires_ns)

    def disarm(self) -> None:
        self._advance()
        self._speed = 0.0
        super().disarm()

    def stop(self) -> None:
        super().stop()
        self._advance()
        self._speed = 0.0


class FakePoses(FakeDevice):
    name = "fake-poses"

    def read(self) -> PoseSample:
        t_ns, seq = self._sample(60.0)
        return PoseSample(t_ns, seq, {"object": Pose((0.0, 0.0, 0.1))})


class Algorithm:
    """Enough of a tracker, detector, estimator and controller for a rig to be built."""

    def __init__(self, options: object, context: BuildContext) -> None:
        self.options = options

    def start(self, frame: object, pad: object = None) -> None: ...

    def update(self, *given: object) -> None: ...

    def reset(self) -> None: ...


class FakeCell:
    def __init__(self, options: object, context: BuildContext) -> None: ...

    def connect(self) -> None: ...

    def close(self) -> None: ...

    def advance(self, t_ns: int) -> None: ...

    def truth(self) -> None: ...


class Incomplete(FakeDevice):
    """Wrong in every way the contract check can see."""

    name = "incomplete"
    stop = None

    async def connect(self) -> None: ...

    def command(self) -> None: ...


def refuse(options: object, context: BuildContext) -> None:
    raise ValueError("no such luck")


def _spec(kind: str, name: str, attribute: str, *, options: bool = True, **more: object) -> BackendSpec:
    return BackendSpec(
        kind,
        name,
        f"fake_cell:{attribute}",
        "fake_cell:Options" if options else None,
        **{"virtual_time": True, "in_cell": True} | more,
    )


SPECS = [
    _spec("sensor", "fake-sensor", "FakeSensor", summary="a fake fingertip"),
    _spec("sensor", "real-sensor", "FakeSensor", virtual_time=False, in_cell=False),
    _spec("gripper", "fake-gripper", "FakeGripper"),
    _spec(
        "gripper",
        "real-gripper",
        "FakeGripper",
        virtual_time=False,
        in_cell=False,
        hardware_verified="Hand-E, 2024-05-01",
    ),
    _spec("gripper", "incomplete", "Incomplete"),
    _spec("gripper", "no-sdk", "FakeGripper", requires=("a_vendor_sdk_nobody_has",), extra="acme"),
    _spec("gripper", "gone", "NoSuchClass"),
    BackendSpec("gripper", "odd-options", "fake_cell:FakeGripper", "fake_cell:FakeGripper"),
    _spec("gripper", "refuses", "refuse"),
    _spec("arm", "fake-arm", "FakeArm"),
    _spec("pose_source", "fake-poses", "FakePoses"),
    _spec("cell", "fake-cell", "FakeCell", options=False),
    _spec("tracker", "plain", "Algorithm", options=False),
    _spec("detector", "plain", "Algorithm", options=False),
    _spec("estimator", "plain", "Algorithm", options=False),
    _spec("controller", "plain", "Algorithm", options=False),
]


def plugin(*specs: BackendSpec) -> SimpleNamespace:
    """Return a plugin that offers these backends."""
    namespace = SimpleNamespace()

    @hookimpl
    def lsds_backends() -> list[BackendSpec]:
        return list(specs)

    namespace.lsds_backends = lsds_backends
    return namespace


def fake_host() -> PluginHost:
    """Return a host with the fakes and nothing that is installed."""
    host = PluginHost(entry_points=[])
    host.register(plugin(*SPECS), distribution="fakes", name="fakes")
    return host


FAKE_RIG = {
    "sensor": {"backend": "fake-sensor"},
    "gripper": {"backend": "fake-gripper"},
    "arm": {"backend": "fake-arm"},
    "cell": {"backend": "fake-cell"},
    "tracker": {"backend": "plain"},
    "detector": {"backend": "plain"},
    "estimator": {"backend": "plain"},
    "controller": {"backend": "plain"},
}
