"""All cases of a client, several at a time, and the files that repeat a finding."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from lsds import __version__
from lsds.errors import DataError, DeviceError
from lsds.testing.torture.cases import KINDS, SEVERITIES, Case, Possible, case_of, possible, unknown
from lsds.testing.torture.course import Course, run_course, started
from lsds.testing.torture.driven import DrivenClient
from lsds.testing.torture.judging import Finding, findings, is_right, recovery_s

HANG_S = 10.0
"""A call without an answer after so long hangs (s): three times the longest time limit that is usual in libraries."""
FORMAT = "lsds client finding"
KEPT_CALLS = 40
"""Number of last calls in the file of a finding."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of one case. `broken`: it could not begin. `recovery_s` is None if the client did not recover."""

    case: Case
    findings: tuple[Finding, ...]
    recovery_s: float | None
    calls: int
    errors: int
    last_error: str
    broken: str = ""
    last_calls: tuple[dict[str, Any], ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return plain values."""
        return {
            "case": self.case.as_json(),
            "findings": [asdict(finding) for finding in self.findings],
            "recovery_s": self.recovery_s,
            "calls": self.calls,
            "errors": self.errors,
            "last_error": self.last_error,
            "broken": self.broken,
        }


def run_case(case: Case, fault: Possible | None, hang_s: float = HANG_S) -> Outcome:
    """Run a case with a new mock and a new process of the client. Raises DataError, ConfigError, ConnectFailed for a
    client or a mock that cannot be started."""
    with DrivenClient(case.client) as client:
        transport, options = client.described()
        with started(case, transport, options) as mock:
            course = Course(case, transport=mock.transport)
            try:
                run_course(course, mock, client, fault, is_right, hang_s)
            except DeviceError as error:
                course.broken = f"the mock does not answer: {error}"
    return _outcome(course)


def _outcome(course: Course) -> Outcome:
    calls = [
        {"call": call.name, "lasted_s": round(call.lasted_s, 4), "value": _short(call.value), "error": call.error}
        for call in course.calls[-KEPT_CALLS:]
    ]
    recovers = None if course.broken else recovery_s(course)
    errors = sum(bool(call.error) for call in course.calls)
    found = () if course.broken else tuple(findings(course))
    return Outcome(
        course.case, found, recovers, len(course.calls), errors, course.last_error, course.broken, tuple(calls)
    )


def _short(value: Any) -> Any:
    return {"size": value["size"]} if isinstance(value, dict) and "size" in value else value


def faults_of(case: Case, kinds: Sequence[str]) -> list[Possible]:
    """Return the faults of a case's mock that are among `kinds`; `all` means all that are known.

    Raises DataError for a kind that the mock does not take.
    """
    if tuple(kinds) == ("none",):
        return []
    with DrivenClient(case.client) as client:
        transport, options = client.described()
    with started(case, transport, options) as mock:
        found = possible(mock, KINDS if tuple(kinds) == ("all",) else kinds)
        if tuple(kinds) != ("all",) and (wrong := unknown(kinds, found)):
            everything = possible(mock)
            raise DataError(unknown(kinds, everything) or wrong)
    return found


def cases_of(base: Case, faults: Sequence[Possible], repeats: int) -> list[tuple[Case, Possible | None]]:
    """Return the cases of a campaign, each `repeats` times with another seed; without faults, those of a healthy
    line."""
    planned: list[tuple[Case, Possible | None]] = []
    for repeat in range(repeats):
        seed = base.seed + repeat
        if not faults:
            planned.append((replace(base, fault="", severity=None, seed=seed), None))
        for fault in faults:
            strengths = SEVERITIES if fault.scaled else (None,)
            planned += [(replace(base, fault=fault.kind, severity=own, seed=seed), fault) for own in strengths]
    return planned


def run_cases(
    planned: Sequence[tuple[Case, Possible | None]],
    jobs: int,
    hang_s: float = HANG_S,
    done: Callable[[int, int], object] = lambda number, count: None,
) -> list[Outcome]:
    """Run cases, `jobs` at a time; return the outcomes in their order. `done` is called with each case that is done."""
    outcomes: dict[int, Outcome] = {}
    with ThreadPoolExecutor(jobs) as pool:
        running = {pool.submit(run_case, case, fault, hang_s): k for k, (case, fault) in enumerate(planned)}
        try:
            for finished in as_completed(running):
                outcomes[running[finished]] = finished.result()
                done(len(outcomes), len(planned))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [outcomes[k] for k in range(len(planned))]


def save(outcome: Outcome, folder: Path) -> Path:
    """Write the file that repeats a finding; return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    case = outcome.case
    name = "-".join([case.client.replace(":", "."), case.title.replace(" ", "-"), str(case.seed)])
    file = folder / f"{name}.json"
    text = {
        "format": FORMAT,
        "lsds": __version__,
        **outcome.as_json(),
        "last_calls": list(outcome.last_calls),
    }
    file.write_text(json.dumps(text, indent=2) + "\n", encoding="utf-8")
    return file


def saved_cases(file: Path) -> Iterator[Case]:
    """Yield the case of a finding's file, or those of a report (`--json`). Raises DataError for any other file."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        entries = content.get("outcomes", [content])
        cases = [case_of(entry["case"]) for entry in entries]
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise DataError(f"{file}: is no finding of lsds check --client: {error}") from error
    yield from cases
