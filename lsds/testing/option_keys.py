"""Checks of a backend's options, the same for every kind."""

from __future__ import annotations

from lsds.registry.options import table_issues
from lsds.testing.bench import Bench

UNKNOWN_KEY = "no_such_option"
"""A key that no backend has."""


def check_unknown_options_are_refused(bench: Bench) -> None:
    """An option that the backend does not have is an error: a misspelt one is not ignored."""
    model = bench.host.options_model(bench.host.find(bench.kind, bench.name))
    if model is None:  # It takes no options at all.
        return
    issues = table_issues(model, {**bench.options, UNKNOWN_KEY: 1}, bench.name)
    assert any(issue.path.endswith(UNKNOWN_KEY) for issue in issues), (
        f"{model.__name__} accepts an option {UNKNOWN_KEY!r}, and so every misspelt one; give it "
        "model_config = ConfigDict(extra='forbid')"
    )


OPTION_CHECKS = (check_unknown_options_are_refused,)
