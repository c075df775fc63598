"""The conformance kit: checks of a plugin's device or algorithm, added to a test suite in three lines.

    from lsds.testing import conformance

    @conformance("gripper", "acme-2f", options={"stroke_mm": 85})
    def test_conformance(check):
        check()

Devices, trackers, detectors, estimators, controllers and jobs have checks. Algorithms get frames that the kit draws.
`run_checks(Bench(...))` returns the results as data; `lsds check KIND:NAME` prints them.

Needs pytest and hypothesis (`pip install 'lsds[testing]'`). The rest of lsds does not import this package.
"""

from lsds.testing.bench import Bench
from lsds.testing.cases import Case, cases, conformance, run_checks
from lsds.testing.outcomes import CheckResult

__all__ = ["Bench", "Case", "CheckResult", "cases", "conformance", "run_checks"]
