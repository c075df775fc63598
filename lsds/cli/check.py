"""`lsds check`: the conformance checks of one backend, on the command line."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lsds.cli.output import json_option, require_writable, write_json
from lsds.cli.plugged import host_of
from lsds.cli.text_table import table

if TYPE_CHECKING:
    from lsds.registry.host import PluginHost
    from lsds.testing import Bench, CheckResult

MEASURED_BY = {
    "detector": "lsds study slip RECORDINGS --detector {name}, lsds study loop --pair {name}+ESTIMATOR",
    "estimator": "lsds study slip RECORDINGS --estimator {name}, lsds study loop --pair DETECTOR+{name}",
    "tracker": "lsds study loop --tracker {name}",
    "controller": "lsds study grip --controller {name}",
}
"""Commands that measure an algorithm which keeps its contract."""


@click.command(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.argument("backend", metavar="KIND:NAME")
@click.option(
    "--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Set an option of the backend; repeatable."
)
@click.option("--allow-motion", is_flag=True, help="Also run checks that move a real device. Stay at the stop button.")
@click.option("--only", multiple=True, metavar="CHECK", help="Run only this check; repeatable.")
@click.option("--list", "only_list", is_flag=True, help="List the checks with their rules, and run none.")
@click.option("--client", metavar="MODULE:CLASS", help="Try this client of another project with the faults of a mock.")
@click.option(
    "--faults", metavar="NAMES", help="With --client: names separated by commas, all, none, or the file of a finding."
)
@click.option("--repeats", type=click.IntRange(1), default=1, show_default=True, help="With --client: runs of a case.")
@click.option("--jobs", type=click.IntRange(1), default=4, show_default=True, help="With --client: runs at a time.")
@click.option("--seed", type=int, help="With --client: seed of the mock's faults; default: the finding's seed, else 0.")
@click.option(
    "--found",
    type=click.Path(file_okay=False, path_type=Path),
    help="With --client: folder for a file of each finding, which repeats it.",
)
@json_option
@click.pass_context
def check(
    ctx: click.Context,
    backend: str,
    overrides: tuple[str, ...],
    allow_motion: bool,
    only: tuple[str, ...],
    only_list: bool,
    client: str | None,
    faults: str | None,
    repeats: int,
    jobs: int,
    seed: int | None,
    found: Path | None,
    json_file: str | None,
) -> int:
    """Check that a device, an algorithm, a fault, a wire mock, a study or a command keeps the contract of its kind.

    Without --allow-motion no real device moves. The exit code is 0 if all checks passed, 1 if one failed, 2 for wrong
    use or wrong options, 3 for a plugin that does not load, 4 for a device that cannot be built, 5 for a client that
    cannot be imported. docs/plugins.md explains the checks.

    With --client, KIND is gripper, arm or sensor, or KIND:MOCK; each fault of the mock is tried at each severity on a
    small class around your driver, in a module that Python finds from here. It reports calls that hang, processes
    that die, wrong values, fingers that open and arms that go on. docs/wire.md explains the class.

    Takes: one to three minutes for a real device, twice its own time for a study, 1 to 60 s for all others; with
    --client and all faults two to five minutes.

    Writes: nothing, except the file of --json, and with --found a file for each finding.

    \b
    Examples:
      lsds check gripper:mock-hand-e                 a simulated gripper, 5 s
      lsds check sensor:mock-gelsight-mini --only frame_rate
      lsds check detector:fused --json checks.json   a detector, 10 s
      lsds check fault:camera-noise
      lsds check wire_mock:hand-e                    on free ports, 5 s
      lsds check study:scheduler --set repeats=1
      lsds check command:study                       only its help and wrong use
      lsds check gripper:hand-e --set port=/dev/ttyUSB0
                                                     without motion, 20 s
      lsds check arm:ur5e --set host=192.168.1.2 --allow-motion
      lsds check arm:mock-ur5e --list
      lsds check gripper --client my_driver:Client --faults drop,delay
      lsds check gripper --client my_driver:Client --found findings
      lsds check gripper --client my_driver:Client --faults findings/drop.json
    """
    from lsds.support.extras import require

    require("pytest", "hypothesis", extra="testing", purpose="lsds check")
    require_writable(json_file)
    if client is not None:
        from lsds.cli.check_client import check_client

        if only or only_list or allow_motion:
            raise click.UsageError("--client runs its own course; leave out --only, --list and --allow-motion")
        return check_client(
            backend,
            client,
            faults or "all",
            overrides=overrides,
            repeats=repeats,
            jobs=jobs,
            seed=seed,
            found=found,
            json_file=json_file,
        )
    if faults or found is not None:
        raise click.UsageError("--faults and --found need --client MODULE:CLASS")
    bench = _bench(backend, overrides, host_of(ctx), allow_motion, built=not only_list)
    _require_checks(bench, only)
    if only_list:
        _list(bench, json_file)
        return 0
    results = _run(bench, only)
    _report(bench, results, json_file)
    return 1 if any(result.outcome == "failed" for result in results) else 0


def _bench(
    backend: str, overrides: tuple[str, ...], host: PluginHost, allow_motion: bool, *, built: bool = True
) -> Bench:
    """Return the bench of KIND:NAME with its options, which are tried if `built`.

    Raises click.UsageError, ConfigError.
    """
    from lsds.config.overrides import apply_overrides
    from lsds.errors import ConfigError, ConfigIssue, PluginNotFound
    from lsds.testing import Bench
    from lsds.testing.tables import CHECKED_KINDS

    kind, _, name = backend.partition(":")
    if not name or kind not in CHECKED_KINDS:
        raise click.UsageError(f"'{backend}' is not KIND:NAME with one of the kinds {', '.join(CHECKED_KINDS)}")
    options: dict[str, Any] = {}
    if issues := apply_overrides(options, overrides):
        raise ConfigError("--set", issues)
    try:
        bench = Bench(kind, name, options, host, allow_motion)
    except PluginNotFound as error:
        raise click.UsageError(f"{error}; install a plugin of your own with pip install -e FOLDER") from error
    if kind == "command":  # Building a command would run it.
        if options:
            issues = [ConfigIssue(key, "a command takes no options") for key in options]
            raise ConfigError("--set", issues)
        host.imported(host.find(kind, name))
        return bench
    if built:
        device = bench.build()  # Report wrong options once, not in every check.
        with suppress(Exception):  # The checks report errors of `close`.
            device.close()
    return bench


def _require_checks(bench: Bench, only: tuple[str, ...]) -> None:
    """Raise click.UsageError for the name of a check that does not exist, with a suggestion."""
    from lsds.registry.backends import did_you_mean
    from lsds.testing import cases

    known = [case.name for case in cases(bench)]
    for name in only:
        if name not in known:
            hint = did_you_mean(name, known) or "--list shows all"
            raise click.UsageError(f"no check for the kind {bench.kind} is named '{name}'; {hint}")


def _run(bench: Bench, only: tuple[str, ...]) -> list[CheckResult]:
    from lsds.cli.progress import Progress
    from lsds.testing import run_checks

    if bench.allow_motion and not bench.virtual:
        click.echo(f"{bench.kind} '{bench.name}' is going to move; stay at the emergency stop", err=True)
    with Progress(f"checking {bench.kind} '{bench.name}'") as progress:
        return run_checks(bench, only, done=lambda result, number, count: progress.to(number, count))


def _report(bench: Bench, results: list[CheckResult], json_file: str | None) -> None:
    from lsds.testing.outcomes import skip_lines

    counts = dict.fromkeys(("passed", "failed", "skipped", "not applicable"), 0)
    for result in results:
        counts[result.outcome] += 1
    skipped = skip_lines(results, command_line=True)
    if json_file is not None:
        rows = [
            {"name": r.name, "outcome": r.outcome, "message": r.message, "rule": r.rule, "needs": r.needs}
            for r in results
        ]
        write_json(
            {"kind": bench.kind, "name": bench.name, "counts": counts, "skipped": skipped, "results": rows}, json_file
        )
        if json_file == "-":
            return
    rows_shown = [(r.name, r.outcome, r.message if r.outcome == "not applicable" else r.rule) for r in results]
    click.echo(table(rows_shown, ("CHECK", "RESULT", "RULE, OR WHY IT DOES NOT APPLY")))
    for names, message in _causes(results):
        click.echo(f"\n{', '.join(names)} failed: " + message.replace("\n", "\n  "))
    click.echo("\n" + ", ".join(f"{count} {outcome}" for outcome, count in counts.items() if count))
    for line in skipped:
        click.echo(line)
    if bench.kind in MEASURED_BY and not counts["failed"]:
        click.echo(f"the checks do not measure accuracy: {MEASURED_BY[bench.kind].format(name=bench.name)}")


def _causes(results: list[CheckResult]) -> list[tuple[list[str], str]]:
    """Return each message of failed checks once, with the names of the checks that failed with its first line."""
    causes: dict[str, tuple[list[str], str]] = {}
    for result in results:
        if result.outcome == "failed":
            causes.setdefault(result.message.partition("\n")[0], ([], result.message))[0].append(result.name)
    return list(causes.values())


def _list(bench: Bench, json_file: str | None) -> None:
    from lsds.testing import cases
    from lsds.testing.tables import guide_of, rule_of

    rows = [(case.name, rule_of(case.check), guide_of(bench.kind, case.check)) for case in cases(bench)]
    if json_file is not None:
        write_json({"checks": [{"name": name, "rule": rule, "guide": guide} for name, rule, guide in rows]}, json_file)
    else:
        click.echo(table([row[:2] for row in rows], ("CHECK", "RULE")))
