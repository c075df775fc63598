"""The conformance kit: a plugin author adds three lines and inherits the suite.

    from lsds.testing import conformance

    @conformance("gripper", "acme-2f", options={"stroke_mm": 85})
    def test_conformance(check):
        check()

Needs pytest and hypothesis (`pip install 'lsds[test]'`). Nothing of the product imports this package.
"""

from lsds.testing.bench import Bench
from lsds.testing.cases import Case, cases, conformance

__all__ = ["Bench", "Case", "cases", "conformance"]
