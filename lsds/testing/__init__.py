"""The conformance kit: checks of a plugin's device or algorithm, added to a test suite in three lines.

    from lsds.testing import conformance

    @conformance("gripper", "acme-2f", options={"stroke_mm": 85})
    def test_conformance(check):
        check()

Devices, trackers, detectors, estimators, controllers and jobs have checks. Algorithms get frames that the kit draws.

Needs pytest and hypothesis (`pip install 'lsds[test]'`). The rest of lsds does not import this package.
"""

from lsds.testing.bench import Bench
from lsds.testing.cases import Case, cases, conformance

__all__ = ["Bench", "Case", "cases", "conformance"]
