"""`lsds study reproduce`: measure the paper's tables on the simulated cell."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import click

from lsds.cli.output import json_option, require_writable, write_json
from lsds.cli.progress import Progress
from lsds.cli.threads import MOST_PROCESSES, one_thread, processes
from lsds.errors import DataError
from lsds.support.extras import require


@click.command()
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("reproduction"),
    show_default=True,
    help="Folder for data, tables and picture.",
)
@click.option("--quick", is_flag=True, help="Use a tenth of the data and fewer fits; takes minutes.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option(
    "--jobs",
    type=click.IntRange(1, MOST_PROCESSES),
    default=processes,
    show_default="one per core",
    help="Number of processes.",
)
@json_option
def reproduce(out: Path, quick: bool, seed: int, jobs: int, json_file: str | None) -> None:
    """Measure the paper's tables on simulated data and compare them with the printed ones.

    Collects the data by the paper's protocols, fits every model with the paper's split and with splits by recording and
    by object, and writes tables.md, results.json and tables.png. After an interrupt, run the same command again to
    continue. Needs the train extra.

    Takes: some 25 minutes on two cores; with --quick 1.5 minutes.

    Writes: data, tables.md, results.json and tables.png to the folder of --out.

    \b
    Examples:
      lsds study reproduce --quick --out quick
      lsds study reproduce --out reproduction --jobs 2
    """
    require_writable(json_file)
    require("pyarrow", "sklearn", "torch", "onnx", "skl2onnx", extra="train", purpose="the reproduction")
    require("numba", extra="sim", purpose="the reproduction")
    require("matplotlib", extra="plot", purpose="the reproduction")
    one_thread()
    from lsds.support.files import write_whole
    from lsds_research.reproduce.measure import measure
    from lsds_research.reproduce.plot import plot_reproduction
    from lsds_research.reproduce.report import markdown

    with ExitStack() as under_way:
        steps: dict[str, Progress] = {}

        def tick(what: str, done: int, whole: int) -> None:
            if what not in steps:
                under_way.close()
                steps[what] = under_way.enter_context(Progress(what))
            steps[what].to(done, whole)

        result = measure(out, seed=seed, quick=quick, jobs=jobs, tick=tick)
    text = markdown(result)
    write_whole(out / "tables.md", text.encode())
    try:
        plot_reproduction(out / "tables.png", result)
    except OSError as error:
        raise DataError(f"{out / 'tables.png'}: cannot be written: {error}") from error
    if json_file is not None:
        write_json(result, json_file)
    if json_file != "-":
        click.echo(text)
    click.echo(f"tables and picture: {out}", err=json_file == "-")
    if result["failed"]:
        raise DataError(f"{len(result['failed'])} fits failed, see {out / 'tables.md'}")
