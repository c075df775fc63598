"""Conformance checks, as a list to loop over, as results and as a pytest decorator."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

import pytest

from lsds.contracts.kinds import Kind
from lsds.registry.host import PluginHost
from lsds.testing.bench import Bench
from lsds.testing.outcomes import NEEDS, CheckResult, Needs, NotApplicable
from lsds.testing.pytest_plugin import SKIPPED
from lsds.testing.tables import MOVING, Check, checks_of, guide_of, name_of, rule_of


@dataclass(frozen=True)
class Case:
    """One check of one backend. Calling it runs the check, which raises AssertionError on failure."""

    bench: Bench
    check: Check

    @property
    def name(self) -> str:
        """The name of the check, without "check_"."""
        return name_of(self.check)

    @property
    def id(self) -> str:
        """A readable name."""
        return f"{self.bench.kind}-{self.bench.name}-{self.name}"

    def __call__(self) -> None:
        """Run the check in pytest. Skips a check that is not applicable, or lacks what it needs."""
        result = self.run()
        if result.outcome == "failed":
            raise AssertionError(result.message) from result.error
        if result.outcome == "skipped":
            pytest.skip(f"{SKIPPED} {result.needs}: {result.message}")
        if result.outcome == "not applicable":
            pytest.skip(f"not applicable: {result.message}")

    def run(self) -> CheckResult:
        """Run the check and return its result. Raises nothing but KeyboardInterrupt and SystemExit."""
        rule = rule_of(self.check)
        try:
            if self.check in MOVING and not self.bench.may_move:
                raise Needs("motion")
            self.check(self.bench)
        except Needs as lacking:
            need = str(lacking)
            python, _, person = NEEDS[need]
            return CheckResult(self.name, "skipped", f"pass {python} and {person}", rule, need)
        except NotApplicable as reason:
            return CheckResult(self.name, "not applicable", str(reason), rule)
        except Exception as error:
            return CheckResult(self.name, "failed", self._message(error), rule, error=error)
        return CheckResult(self.name, "passed", rule=rule)

    def _message(self, error: Exception) -> str:
        """Return what failed, the rule, and the section of the guide."""
        guide = guide_of(self.bench.kind, self.check)
        return "\n".join([*_lines(error), f"rule: {rule_of(self.check)}", f"guide: {guide}"])


def _lines(error: BaseException) -> list[str]:
    """Return the text of an error, with the steps that Hypothesis notes, or those of all errors of a group."""
    if isinstance(error, BaseExceptionGroup):
        return [line for part in error.exceptions for line in _lines(part)]
    text = str(error) if isinstance(error, AssertionError) else f"{type(error).__name__}: {error}"
    if not str(error):
        text = f"{type(error).__name__} without a message{_place(error)}"
    return [text, *(f"  {note}" for note in getattr(error, "__notes__", ()))]


def _place(error: BaseException) -> str:
    """Return the file and line that raised an error, or an empty string."""
    frames = traceback.extract_tb(error.__traceback__)
    return f" at {frames[-1].filename}:{frames[-1].lineno}: {frames[-1].line}" if frames else ""


def cases(bench: Bench) -> list[Case]:
    """Return all checks for the bench's kind. Raises ValueError for a kind without checks."""
    return [Case(bench, check) for check in checks_of(bench.kind)]


def run_checks(
    bench: Bench, only: Collection[str] = (), done: Callable[[CheckResult, int, int], None] | None = None
) -> list[CheckResult]:
    """Return the results of all checks of a bench, or of those named in `only` (without "check_").

    `done` is called after every check with its result, its number and the number of checks. Raises ValueError for a
    kind without checks, and for a name in `only` that is not the name of a check.
    """
    chosen = cases(bench)
    if unknown := set(only) - {case.name for case in chosen}:
        raise ValueError(
            f"no check for the kind {bench.kind} is named {', '.join(sorted(unknown))}; "
            f"its checks: {', '.join(case.name for case in chosen)}"
        )
    chosen = [case for case in chosen if not only or case.name in only]
    results = []
    for number, case in enumerate(chosen, 1):
        results.append(case.run())
        if done is not None:
            done(results[-1], number, len(chosen))
    return results


def conformance(
    kind: Kind,
    name: str,
    *,
    options: Mapping[str, Any] | None = None,
    host: PluginHost | None = None,
    allow_motion: bool = False,
    unplug: Callable[[Any], None] | None = None,
    expected_failures: Mapping[str, str] | None = None,
) -> pytest.MarkDecorator:
    """Decorate a test that takes `check` and calls it: it becomes one test for each check.

    `options` is the backend's options table. `unplug` cuts the connection of a connected device. `expected_failures`
    maps the name of a check (without "check_") to the reason why it cannot pass yet; an expected failure that passes is
    an error.
    """
    bench = Bench(kind, name, options or {}, host or PluginHost(), allow_motion, unplug)
    expected = dict(expected_failures or {})
    parameters = []
    for case in cases(bench):
        reason = expected.pop(case.name, None)
        marks = [pytest.mark.xfail(reason=reason, strict=True)] if reason else []
        parameters.append(pytest.param(case, id=case.id, marks=marks))
    if expected:
        raise ValueError(f"expected_failures names checks that do not exist: {', '.join(expected)}")
    return pytest.mark.parametrize("check", parameters)
