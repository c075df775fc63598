"""The result of a check as data, and the exceptions by which a check reports that it cannot be made."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

Outcome = Literal["passed", "failed", "skipped", "not applicable"]

NEEDS = {
    "motion": ("allow_motion=True", "--allow-motion", "stay at the emergency stop"),
    "unplug": ("unplug=FUNCTION", "unplug=FUNCTION to lsds.testing.Bench", "let it cut the device's connection"),
}
"""Needs of skipped checks: name -> (argument in Python, on the command line, and what else to do)."""


@dataclass(frozen=True, slots=True)
class CheckResult:
    """The result of one check.

    `rule` is the promise that the check tests, `message` the reason of any outcome but "passed", and `needs` the key of
    `NEEDS` of a skipped check. `error` is the exception behind a failure.
    """

    name: str
    outcome: Outcome
    message: str = ""
    rule: str = ""
    needs: str = ""
    error: BaseException | None = field(default=None, repr=False, compare=False)


class NotApplicable(Exception):
    """Raised by a check that has no meaning for this device, with the reason."""


class Needs(Exception):
    """Raised by a check that cannot run without something; the argument is a key of `NEEDS`."""


def skip_lines(results: list[CheckResult], *, command_line: bool) -> list[str]:
    """Return a line for each need of skipped checks: "8 motion checks skipped: pass ... and ..."."""
    lines = []
    for need, (python, flag, person) in NEEDS.items():
        count = sum(result.needs == need for result in results)
        if count:
            lines.append(skip_line(need, count, flag if command_line else python, person))
    return lines


def skip_line(need: str, count: int, argument: str, person: str) -> str:
    """Return the line about `count` checks that were skipped for the same need."""
    return f"{count} {need} check{'s' if count != 1 else ''} skipped: pass {argument} and {person}"
