"""`lsds check KIND --client MODULE:CLASS`: every fault of a wire mock against any driver."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lsds.cli.output import write_json
from lsds.cli.text_table import table

if TYPE_CHECKING:
    from lsds.testing.torture.campaign import Outcome
    from lsds.testing.torture.cases import Case, Possible

FINDS = 1
"""Exit code if there is a finding, or a case that could not begin: nothing is known of it."""


def check_client(
    backend: str,
    client: str,
    faults: str,
    *,
    overrides: Sequence[str] = (),
    repeats: int = 1,
    jobs: int = 4,
    seed: int | None = None,
    found: Path | None = None,
    json_file: str | None = None,
) -> int:
    """Try a client; print the table of outcomes and return the exit code.

    A finding in a file is repeated with its own seed and settings, except for those that are given. Raises UsageError,
    ConfigError, DataError.
    """
    from lsds.cli.progress import Progress
    from lsds.testing.torture.campaign import run_case, run_cases, save

    if found is not None:
        _require_folder(found)
    base = _base(backend, client, overrides, seed or 0)
    planned = _planned(base, faults, repeats, seed, overrides)
    settings = planned[0][0].settings if planned else base.settings
    healthy = run_case(replace(base, fault="", severity=None, settings=settings), None)
    if reason := healthy.broken or next((finding.text for finding in healthy.findings), ""):
        raise click.ClickException(
            f"client {base.client} does not work on a healthy line, so a fault would show nothing: {reason}"
        )
    with Progress(f"trying {base.client}") as progress:
        outcomes = run_cases(planned, jobs, done=progress.to)
    files = {}
    if found is not None:
        files = {k: save(outcome, found) for k, outcome in enumerate(outcomes) if outcome.findings}
    _report(base, outcomes, files, json_file)
    return FINDS if any(outcome.findings or outcome.broken for outcome in outcomes) else 0


def _require_folder(folder: Path) -> None:
    """Make the folder of findings. Raises DataError now and not after minutes of trials."""
    from lsds.errors import DataError

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"--found {folder}: the folder cannot be made: {error.strerror}; name another one") from error


def _base(backend: str, client: str, overrides: Sequence[str], seed: int) -> Case:
    """Return the case without a fault. Raises click.UsageError, ConfigError."""
    from lsds.config.overrides import apply_overrides
    from lsds.errors import ConfigError
    from lsds.testing.torture.cases import MOCKS, Case

    kind, _, mock = backend.partition(":")
    if kind not in MOCKS:
        raise click.UsageError(f"'{kind}' has no course for a client; write one of {', '.join(MOCKS)}, or KIND:MOCK")
    settings: dict[str, Any] = {}
    if issues := apply_overrides(settings, tuple(overrides)):
        raise ConfigError("--set", issues)
    return Case(kind, mock or MOCKS[kind], client, seed=seed, settings=tuple(settings.items()))


def _planned(
    base: Case, faults: str, repeats: int, seed: int | None, overrides: Sequence[str]
) -> list[tuple[Case, Possible | None]]:
    """Return the cases of names of faults, of `all`, of `none`, or of the file of a finding."""
    from lsds.config.overrides import apply_overrides
    from lsds.testing.torture.campaign import cases_of, faults_of, saved_cases

    if not faults.endswith(".json"):
        names = [name.strip() for name in faults.split(",") if name.strip()]
        return cases_of(base, faults_of(base, names), repeats)
    cases = list(saved_cases(Path(faults)))
    known = {fault.kind: fault for fault in faults_of(base, sorted({case.fault for case in cases} - {""}) or ["none"])}
    planned: list[tuple[Case, Possible | None]] = []
    for case in cases:
        settings = deepcopy(dict(case.settings))
        apply_overrides(settings, tuple(overrides))
        own = replace(case, kind=base.kind, mock=base.mock, client=base.client, settings=tuple(settings.items()))
        first = case.seed if seed is None else seed
        planned += [(replace(own, seed=first + repeat), known.get(case.fault)) for repeat in range(repeats)]
    return planned


def _report(base: Case, outcomes: Sequence[Outcome], files: dict[int, Path], json_file: str | None) -> None:
    counts = Counter(finding.kind for outcome in outcomes for finding in outcome.findings)
    broken = [outcome for outcome in outcomes if outcome.broken]
    if json_file is not None:
        content = {
            "client": base.client,
            "kind": base.kind,
            "mock": base.mock,
            "simulated": True,
            "counts": dict(counts),
            "not_begun": len(broken),
            "outcomes": [
                outcome.as_json() | {"file": str(files[k]) if k in files else None}
                for k, outcome in enumerate(outcomes)
            ],
        }
        write_json(content, json_file)
        if json_file == "-":
            return
    click.echo(f"{base.client} against the mock {base.mock}\n")
    click.echo(
        table([_row(outcome) for outcome in outcomes], ("FAULT", "FINDINGS", "ERRORS", "RIGHT AGAIN", "WHAT IT DID"))
    )
    words = ", ".join(f"{count} x {kind}" for kind, count in counts.most_common()) or "no findings"
    click.echo(f"\n{len(outcomes)} cases: {words}" + (f"; {len(broken)} could not begin" if broken else ""))
    if files:
        first = next(iter(files.values()))
        click.echo(f"repeat one: lsds check {base.kind}:{base.mock} --client {base.client} --faults {first}")


def _row(outcome: Outcome) -> tuple[str, str, str, str, str]:
    if outcome.broken:
        return outcome.case.title, "not begun", "", "", outcome.broken
    kinds = ", ".join(dict.fromkeys(finding.kind for finding in outcome.findings)) or "none"
    again = "no" if outcome.recovery_s is None else f"{outcome.recovery_s:.2f} s"
    text = outcome.findings[0].text if outcome.findings else outcome.last_error
    return outcome.case.title, kinds, f"{outcome.errors} of {outcome.calls}", again, text
