"""`lsds study choose`: the cheapest rig within limits of slip and grip."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lsds.cli.finite import FiniteRange
from lsds.cli.output import json_option, require_writable, write_json
from lsds.cli.progress import Progress
from lsds.cli.threads import MOST_PROCESSES, processes

if TYPE_CHECKING:
    Row = dict[str, Any]

_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "s": 1.0, "ms": 1e-3, "us": 1e-6}


class Quantity(click.ParamType[float]):
    """A number with a unit, converted to SI."""

    def __init__(self, name: str, units: tuple[str, ...]) -> None:
        self.name, self._units = name, units

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number in SI units."""
        if isinstance(value, float):
            return value
        found = re.fullmatch(r"\s*(-?[0-9]*\.?[0-9]+)\s*([a-z]+)\s*", str(value))
        if found is None or found[2] not in self._units:
            units = ", ".join(self._units)
            self.fail(f"'{value}' is no {self.name}: write a number and one of {units}, such as 5{self._units[0]}")
        if not float(found[1]) > 0:
            self.fail(f"'{value}' is not above zero: write a {self.name} greater than zero")
        return float(found[1]) * _UNITS[found[2]]


@click.command()
@click.option("--max-slip", type=Quantity("length", ("mm", "cm", "m", "um")), help="Maximum median slip, such as 5mm.")
@click.option("--max-grip", type=FiniteRange(min=1), help="Maximum median ratio of steady grip to needed grip.")
@click.option(
    "--budget", type=Quantity("time", ("ms", "us", "s")), help="Maximum time from image to command, such as 1ms."
)
@click.option(
    "--budget-ms",
    "budgets_ms",
    type=FiniteRange(0, 1000),
    multiple=True,
    default=(0.0,),
    show_default=True,
    help="Budget of time for a frame (tactile.budget_ms) to try; 0: none; repeatable.",
)
@click.option("--runs", type=click.Path(dir_okay=False, path_type=Path), help="Runs of `lsds study loop --out FILE`.")
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), help="Also write the rig file here.")
@click.option("--quick", is_flag=True, help="Fewer objects and configurations.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option(
    "--jobs",
    type=click.IntRange(1, MOST_PROCESSES),
    default=processes,
    show_default="one per core",
    help="Number of processes.",
)
@json_option
def choose(
    max_slip: float | None,
    max_grip: float | None,
    budget: float | None,
    budgets_ms: tuple[float, ...],
    runs: Path | None,
    out: Path | None,
    quick: bool,
    seed: int,
    jobs: int,
    json_file: str | None,
) -> None:
    """Print the cheapest rig file within the limits of slip and grip.

    The command lifts objects with whole configurations, as `lsds study loop` does. It selects the configuration that is
    fastest on this machine (mean over frames) among those that hold all objects within the limits. With --runs FILE it
    reuses the lifts in that file and adds its own. Slip and grip are simulated. The exit code is 1 if no configuration
    meets the limits.

    Takes: as long as `lsds study loop`; seconds if --runs has all lifts.

    Writes: nothing, except the rig file of --out and new lifts to that of --runs; the rig goes to stdout.

    \b
    Examples:
      lsds study choose --max-slip 5mm --max-grip 1.5 --budget 1ms
      lsds study choose --max-slip 5mm --runs loop.jsonl --out rig.toml
    """
    for target in (out, json_file):
        require_writable(target)
    from lsds_research.studies.loop.options import LoopOptions
    from lsds_research.studies.loop.study import measured

    options = LoopOptions(out="" if runs is None else str(runs), quick=quick, jobs=jobs, budgets_ms=[*budgets_ms])
    with Progress("lifting") as progress:
        rows, _, failures = measured(options, seed, progress.to)
    for name, reason in failures.items():
        click.echo(f"warning: failed: {name}: {reason}", err=True)
    limits = {"slip_mm": _times(max_slip, 1e3), "steady": max_grip, "frame_us": _times(budget, 1e6)}
    fits = sorted((row for row in rows if _within(row, limits)), key=lambda row: row["frame_us"])
    text = _rig_file(fits[0]) if fits else ""
    if json_file is not None:
        write_json({"chosen": fits[0] if fits else None, "configurations": rows, "figures_are": "simulated"}, json_file)
    if not fits:
        click.echo(f"no configuration meets the limits; {_nearest(rows, limits)}", err=True)
        raise SystemExit(1)
    if out is not None:
        from lsds.support.files import write_whole

        write_whole(out, text.encode())
    if json_file != "-":
        click.echo(text, nl=False)


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def _within(row: Row, limits: dict[str, float | None]) -> bool:
    if row["held"] < 1:
        return False
    return all(limit is None or (row[name] is not None and row[name] <= limit) for name, limit in limits.items())


def _nearest(rows: list[Row], limits: dict[str, float | None]) -> str:
    """Return the configuration that exceeds the limits least, as text."""
    held = [row for row in rows if row["held"] == 1 and row["steady"] is not None]
    if not held:
        return "every one dropped something"

    def excess(row: Row) -> float:
        return max(float(row[name]) / limit for name, limit in limits.items() if limit is not None)

    best = min(held, key=excess)
    return (
        f"nearest: {best['configuration']}, slip {best['slip_mm']:.1f} mm, steady grip {best['steady']:.2f} times "
        f"needed, {best['frame_us']:.0f} us from image to command"
    )


def _rig_file(row: Row) -> str:
    from lsds.config.toml import dumps

    kinds = ("tracker", "detector", "estimator", "controller")
    head = (
        f"# Selected by `lsds study choose`: {row['frame_us']:.0f} us from image to command on this machine; "
        f"simulated: slip {row['slip_mm']:.1f} mm, steady grip {row['steady']:.2f} times needed, "
        f"{row['runs']} lifts held.\n"
    )
    tables: dict[str, dict[str, Any]] = {kind: {"backend": row[kind]} for kind in kinds}
    if row["budget_ms"]:
        tables["tactile"] = {"budget_ms": row["budget_ms"]}
    return head + dumps(tables)
