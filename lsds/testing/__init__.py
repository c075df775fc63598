"""The conformance kit: checks of a plugin's backend, added to a test suite in three lines.

    from lsds.testing import conformance

    @conformance("gripper", "acme-2f", options={"stroke_mm": 85})
    def test_conformance(check):
        check()

Devices, trackers, detectors, estimators, controllers, jobs, faults, wire mocks, studies and commands have checks.
Algorithms get frames that the kit draws.
`run_checks(Bench(...))` returns the results as data; `lsds check KIND:NAME` prints them.

`wire_mock("hand-e")` starts a mock device in its own process, for tests of any driver.

All but `wire_mock` need pytest and hypothesis (`pip install 'lsds-tactile[testing]'`). The rest of lsds does not import
this package. Its names are imported on first use, so that the pytest plugin in it (`lsds.testing.pytest_plugin`) does
not delay pytest.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from lsds.testing.bench import Bench
    from lsds.testing.case import Case, cases, conformance, run_checks
    from lsds.testing.mock_handle import MockHandle, wire_mock
    from lsds.testing.outcomes import CheckResult

_HOMES = {
    "Bench": "bench",
    "Case": "case",
    "CheckResult": "outcomes",
    "MockHandle": "mock_handle",
    "cases": "case",
    "conformance": "case",
    "run_checks": "case",
    "wire_mock": "mock_handle",
}
_NEEDS_NO_EXTRA = ("MockHandle", "wire_mock")
"""Names that work without pytest and hypothesis, so that any test runner can use them."""

__all__ = ["Bench", "Case", "CheckResult", "MockHandle", "cases", "conformance", "run_checks", "wire_mock"]


def __getattr__(name: str) -> Any:
    import importlib

    from lsds.support.extras import require

    if name not in _HOMES:
        raise AttributeError(f"module 'lsds.testing' has no attribute '{name}'; it has {', '.join(__all__)}")
    if name not in _NEEDS_NO_EXTRA:
        require("pytest", "hypothesis", extra="testing", purpose="lsds.testing")
    value = getattr(importlib.import_module(f"lsds.testing.{_HOMES[name]}"), name)
    globals()[name] = value
    return value
