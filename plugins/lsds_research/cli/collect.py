"""`lsds learn collect`: record a dataset by a protocol of the paper, on the cell of a config."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from lsds.cli.complete import simulated_object
from lsds.cli.output import json_option, require_writable, write_json
from lsds.cli.progress import Progress
from lsds.cli.set_option import set_option
from lsds.cli.text_table import table
from lsds.cli.threads import MOST_PROCESSES, processes
from lsds.support.extras import require

if TYPE_CHECKING:
    from lsds_research.collecting.trials import Job


@click.command()
@click.argument("job", type=click.Choice(["detection", "severity", "pipe", "catch", "loads"]))
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), required=True, help="Folder of the dataset.")
@click.option("--config", "config_file", type=click.Path(dir_okay=False), help="TOML config of the rig.")
@set_option("Override one config key; repeatable.")
@click.option(
    "--object",
    "objects",
    multiple=True,
    metavar="NAME",
    shell_complete=simulated_object,
    help="Record only this object; repeatable.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option("--quick", is_flag=True, help="Record about a tenth of the protocol, as a trial.")
@click.option(
    "--jobs",
    type=click.IntRange(1, MOST_PROCESSES),
    default=processes,
    show_default="one per core",
    help="Number of processes; simulated cells only.",
)
@click.option(
    "--record",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Keep a recording of each run, NAME.mcap, in this folder (extra record).",
)
@json_option
def collect(
    job: str,
    out: Path,
    config_file: str | None,
    overrides: tuple[str, ...],
    objects: tuple[str, ...],
    seed: int,
    quick: bool,
    jobs: int,
    record: Path | None,
    json_file: str | None,
) -> None:
    """Record a dataset by a protocol: detection, severity or pipe as in the paper, catch, or loads.

    catch: grip an object while it slips. loads: lift, shake, fill and shove a firmly held object that does not slip.

    Each recording is written to disk as soon as it is done. After an interrupt, a full disk or a failed trial, run the
    same command again to continue. Without --config it records in the simulated cell, and all figures from the dataset
    are simulated. On a real cell, the command prompts for each object before the arm moves.

    Takes: three minutes of motion per object for detection on a real cell; a tenth with --quick.

    Writes: the folder of --out, trial by trial.

    \b
    Examples:
      lsds learn collect detection --out detection
      lsds learn collect severity --out severity --object can --object ruler
      lsds learn collect pipe --out pipe --quick --jobs 1
      lsds learn collect catch --out catch --record runs
    """
    require_writable(json_file)
    require("pyarrow", extra="data", purpose="a dataset")
    import numpy as np

    from lsds_research.collecting.campaign import collect as run
    from lsds_research.collecting.trials import Trial

    def prepare(trial: Trial) -> None:
        how = "clamped to the table" if trial.clamped else "standing free"
        click.prompt(
            f"\n{trial.recording}: move the arm back to its start, open the fingers, place {trial.object} "
            f"between them, {how}; press Enter when the cell is clear",
            default="",
            show_default=False,
            err=True,
        )

    with Progress(f"collecting {job}") as progress:
        data = run(
            cast("Job", job),
            out,
            config_file=config_file,
            overrides=overrides,
            objects=objects or None,
            seed=seed,
            quick=quick,
            jobs=jobs,
            tick=lambda done, whole, _: progress.to(done, whole),
            prepare=prepare if sys.stdin.isatty() else None,
            record=record,
        )
    for recording, reason in data.card.get("stopped", {}).items():
        click.echo(f"left out: {recording}: {reason}", err=True)
    rows = []
    for name in dict.fromkeys(data["object"].tolist()):
        own = data["object"] == name
        slip = data["slip"][own]
        rows.append((name, len(np.unique(data["recording"][own])), int(own.sum()), float(np.mean(slip == 1))))
    if json_file is not None:
        keys = ("object", "recordings", "frames", "slip_share")
        write_json(
            {"out": str(out), "card": data.card, "objects": [dict(zip(keys, row, strict=True)) for row in rows]},
            json_file,
        )
    if json_file != "-":
        shown = [(name, str(count), str(frames), f"{share:.2f}") for name, count, frames, share in rows]
        click.echo(table(shown, ("object", "recordings", "frames", "slips")))
        click.echo(f"\n{len(data)} frames in {out} ({data.card.get('figures_are')}; labels: {data.card.get('labels')})")
