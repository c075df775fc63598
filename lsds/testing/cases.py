"""Conformance checks, as a list to loop over and as a pytest decorator."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import pytest

from lsds.contracts.kinds import Kind
from lsds.plugins.host import PluginHost
from lsds.testing.algorithms import ALGORITHM_CHECKS
from lsds.testing.bench import Bench
from lsds.testing.corrections import CONTROLLER_CHECKS
from lsds.testing.lifecycle import LIFECYCLE_CHECKS
from lsds.testing.machine import check_any_order_of_calls
from lsds.testing.motion import ARM_CHECKS, GRIPPER_CHECKS
from lsds.testing.sensing import POSE_CHECKS, SENSOR_CHECKS
from lsds.testing.slip_answers import DETECTOR_CHECKS, ESTIMATOR_CHECKS
from lsds.testing.tracks import TRACKER_CHECKS
from lsds.testing.wishes import JOB_CHECKS

Check = Callable[[Bench], None]

_CHECKS: dict[Kind, tuple[Check, ...]] = {
    "sensor": SENSOR_CHECKS,
    "gripper": GRIPPER_CHECKS,
    "arm": ARM_CHECKS,
    "pose_source": POSE_CHECKS,
}
_ALGORITHM_CHECKS: dict[Kind, tuple[Check, ...]] = {
    "tracker": TRACKER_CHECKS,
    "detector": DETECTOR_CHECKS,
    "estimator": ESTIMATOR_CHECKS,
    "controller": CONTROLLER_CHECKS,
    "job": JOB_CHECKS,
}
_MOVING: frozenset[Check] = frozenset({*GRIPPER_CHECKS, *ARM_CHECKS})


@dataclass(frozen=True)
class Case:
    """One check of one backend. Calling it runs the check, which raises AssertionError on failure."""

    bench: Bench
    check: Check

    @property
    def id(self) -> str:
        """A readable name."""
        return f"{self.bench.kind}-{self.bench.name}-{self.check.__name__.removeprefix('check_')}"

    def __call__(self) -> None:
        """Run the check. Skips a check that would move a real device without permission."""
        if self.check in _MOVING and not self.bench.may_move:
            pytest.skip("moves a real device; pass allow_motion=True and stay at the emergency stop")
        self.check(self.bench)


def cases(bench: Bench) -> list[Case]:
    """Return all checks for the bench's kind of device or algorithm. Raises ValueError for a kind without checks."""
    if bench.kind in _ALGORITHM_CHECKS:
        return [Case(bench, check) for check in (*ALGORITHM_CHECKS, *_ALGORITHM_CHECKS[bench.kind])]
    if bench.kind not in _CHECKS:
        raise ValueError(f"there are no conformance checks for a {bench.kind}")
    checks = (*LIFECYCLE_CHECKS, *_CHECKS[bench.kind], check_any_order_of_calls)
    return [Case(bench, check) for check in checks]


def conformance(
    kind: Kind,
    name: str,
    *,
    options: Mapping[str, Any] | None = None,
    host: PluginHost | None = None,
    allow_motion: bool = False,
    expected_failures: Mapping[str, str] | None = None,
) -> pytest.MarkDecorator:
    """Decorate a test that takes `check` and calls it: it becomes one test for each check.

    `options` is the backend's options table. `expected_failures` maps the name of a check (without "check_") to the
    reason why it cannot pass yet; an expected failure that passes is an error.
    """
    bench = Bench(kind, name, options or {}, host or PluginHost(), allow_motion)
    expected = dict(expected_failures or {})
    parameters = []
    for case in cases(bench):
        reason = expected.pop(case.check.__name__.removeprefix("check_"), None)
        marks = [pytest.mark.xfail(reason=reason, strict=True)] if reason else []
        parameters.append(pytest.param(case, id=case.id, marks=marks))
    if expected:
        raise ValueError(f"expected_failures names checks that do not exist: {', '.join(expected)}")
    return pytest.mark.parametrize("check", parameters)
