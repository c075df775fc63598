"""Regression scenarios, found by a campaign or a search: none of them may fail.

`lsds study search --found tests/closed_loop/found` adds to them.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from lsds_research.search.robustness import least, margins_of

from lsds.session.run import run

FOUND = sorted((Path(__file__).parent / "found").glob("*.toml"))


@pytest.mark.parametrize("file", FOUND, ids=lambda file: file.stem)
def test_regression_scenarios_do_not_fail(file):
    session = run(file)
    way, margin = least(margins_of(session))
    assert margin >= 0, f"{way}: {session.summary['outcome']}, {session.summary['fault']}"
    assert not session.truths[-1].dropped


def test_there_is_something_to_look_at():
    assert FOUND
