"""Random call sequences: Hypothesis searches for a sequence of calls that breaks the contract of a device."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from hypothesis import HealthCheck, settings
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule, run_state_machine_as_test

from lsds.contracts.devices import Lifecycle
from lsds.contracts.values import ArmCommand, GripperCommand, Twist
from lsds.errors import CommandExpired, DeviceError, LifecycleError, LimitExceeded, StaleData
from lsds.testing.bench import Bench

N, C, A, X = Lifecycle.NEW, Lifecycle.CONNECTED, Lifecycle.ARMED, Lifecycle.CLOSED


def check_any_order_of_calls(bench: Bench, examples: int | None = None, steps: int = 20) -> None:
    """In any order of calls only documented errors are raised, and the state follows the contract.

    `examples` is the number of sequences to try; by default fewer on hardware, where each takes long.
    """
    if examples is None:
        examples = 25 if bench.virtual else 8
    machine = type("DeviceMachine", (_DeviceMachine,), {"bench": bench})
    run_state_machine_as_test(
        machine,
        settings=settings(
            max_examples=examples,
            stateful_step_count=steps,
            deadline=None,
            derandomize=True,
            database=None,
            suppress_health_check=list(HealthCheck),  # pyright: ignore[reportArgumentType] Hypothesis types it as its metaclass
        ),
    )


class _DeviceMachine(RuleBasedStateMachine):
    bench: Bench

    def __init__(self) -> None:
        super().__init__()
        self.device = self.bench.build()
        self.state = N

    @rule()
    def connect(self) -> None:
        self._transition(self.device.connect, allowed=(N,), then=C)

    @precondition(lambda self: self.bench.may_move)
    @rule()
    def arm(self) -> None:
        self._transition(self.device.arm, allowed=(C,), then=A)

    @rule()
    def disarm(self) -> None:
        self.device.disarm()
        self.state = C if self.state is A else self.state

    @rule()
    def stop(self) -> None:
        self.device.stop()
        self.state = self.device.lifecycle if self.state is A and self.device.lifecycle is C else self.state

    @precondition(lambda self: self.state is not N)
    @rule()
    def close(self) -> None:
        self.device.close()
        self.state = X

    @rule()
    def read(self) -> None:
        if self.state in (C, A):
            try:
                sample = self.device.read()
            except (StaleData, EOFError):
                return
            late_ns = sample.t_ns - self.bench.clock.now()
            assert late_ns <= 0, f"the time stamp of a sample lies {late_ns * 1e-9:.4f} s in the future"
        else:
            _expect(self.device.read, LifecycleError)

    @precondition(lambda self: self.bench.kind in ("gripper", "arm"))
    @rule()
    def command(self) -> None:
        command = a_command(self.bench, self.bench.in_future())
        if self.state is A:
            self.device.command(command)
        else:
            _expect(lambda: self.device.command(command), LifecycleError)

    @precondition(lambda self: self.bench.kind in ("gripper", "arm") and self.state is A)
    @rule()
    def command_late(self) -> None:
        command = a_command(self.bench, self.bench.clock.now() - 1)
        _expect(lambda: self.device.command(command), CommandExpired)

    @precondition(lambda self: self.bench.kind in ("gripper", "arm") and self.state is A)
    @rule()
    def command_nonsense(self) -> None:
        command = a_command(self.bench, self.bench.in_future(), math.nan)
        _expect(lambda: self.device.command(command), LimitExceeded)

    @rule()
    def let_time_pass(self) -> None:
        self.bench.advance(0.02)

    @invariant()
    def state_is_as_documented(self) -> None:
        assert self.device.lifecycle is self.state, f"the device is {self.device.lifecycle}, expected {self.state}"

    def teardown(self) -> None:
        self.device.close()

    def _transition(self, call: Callable[[], Any], allowed: tuple[Lifecycle, ...], then: Lifecycle) -> None:
        if self.state in allowed:
            call()
            self.state = then
        else:
            _expect(call, LifecycleError)


def a_command(bench: Bench, expires_ns: int, value: float = 0.02) -> Any:
    """Return a small command for the bench's kind of device: an aperture in m, or a velocity along z in m/s."""
    if bench.kind == "gripper":
        return GripperCommand(value, speed_m_s=0.05, force_n=20.0, expires_ns=expires_ns)
    return ArmCommand(Twist((0.0, 0.0, value)), acceleration_m_s2=0.5, expires_ns=expires_ns)


def _expect(call: Callable[[], Any], wanted: type[DeviceError]) -> None:
    try:
        call()
    except wanted:
        return
    except Exception as error:
        raise AssertionError(f"raised {type(error).__name__}, expected {wanted.__name__}: {error}") from error
    raise AssertionError(f"raised nothing; expected {wanted.__name__}")
