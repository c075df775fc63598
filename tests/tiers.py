"""Tiers of the tests by measured duration: quick for the edit loop, the usual ones, and slow ones.

`durations.json` has the duration (s) of each test that took long enough to matter, on one of two busy cores. A test
that is not in it is quick. `@pytest.mark.slow` makes a test slow in any case, `@pytest.mark.usual` keeps one that
protects the main promises in the usual tier, however long it takes. To measure again:
`pytest -n 2 -m 'slow or not slow' --store-durations tests/durations.json`.
"""

from __future__ import annotations

import json
from collections import defaultdict
from pathlib import Path

FILE = Path(__file__).with_name("durations.json")
SLOW_S = 0.4
"""A test that takes longer is slow: the others take less than eight minutes on two cores."""
QUICK_S = 0.2
"""A test that takes longer is not quick."""
QUICK_FOLDERS = ("grip", "models", "property", "tactile", "unit")
"""Folders of tests/ whose tests need no process, no document and no whole lift."""


def stored(file: Path | None = None) -> dict[str, float]:
    """Return the durations (s) by node id."""
    by_file = json.loads((file or FILE).read_text(encoding="utf-8"))
    return {f"{file}::{test}": seconds for file, tests in by_file.items() for test, seconds in tests.items()}


def store(durations: dict[str, float], file: Path) -> None:
    """Write durations by file and test, those that matter, in an order that keeps differences small.

    Those of tests that did not run now stay as they are.
    """
    by_file: dict[str, dict[str, float]] = defaultdict(dict)
    known = stored(file) if file.exists() else {}
    for node, seconds in sorted({**known, **durations}.items()):
        if seconds > QUICK_S:
            path, _, test = node.partition("::")
            by_file[path][test] = round(seconds, 1)
    file.write_text(json.dumps(by_file, indent=0) + "\n", encoding="utf-8")


def tiers(node: str, marks: set[str], durations: dict[str, float]) -> set[str]:
    """Return the marks that a test gets, by its node id, its own marks and the durations."""
    seconds = durations.get(node, 0.0)
    if "slow" in marks:
        return set()
    if seconds > SLOW_S and "usual" not in marks:
        return {"slow"}
    folder = node.split("/")[1] if node.count("/") > 1 else ""
    return {"quick"} if seconds <= QUICK_S and folder in QUICK_FOLDERS else set()
