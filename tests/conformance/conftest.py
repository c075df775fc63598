"""Fixtures of the conformance tests."""

from __future__ import annotations

import pytest
from catching import LEFT


@pytest.fixture(autouse=True)
def _nothing_is_left():
    yield
    while LEFT:
        LEFT.pop(0)()
