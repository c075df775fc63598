"""`lsds chart`: speed against accuracy, measured here and now."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from itertools import count
from pathlib import Path

import click

from lsds.cli.output import csv_text, json_option, table, write_json, write_text
from lsds.cli.progress import Progress
from lsds.cli.study_output import study_command
from lsds.cli.threads import one_thread
from lsds.errors import DataError


def _outputs(plot: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Options of where a study's picture, table and JSON go."""

    def add(command: Callable[..., None]) -> Callable[..., None]:
        to_plot = click.option(
            "--plot", type=click.Path(dir_okay=False, path_type=Path), default=Path(plot), show_default=True
        )
        to_csv = click.option("--csv", "csv_file", metavar="FILE", help="Write the table as CSV.")
        return to_plot(to_csv(json_option(command)))

    return add


@click.group()
def chart() -> None:
    """Measure what things cost and what they give for it.

    \b
    Examples:
      lsds chart frame --plot frame.png --csv frame.csv
      lsds chart scheduler
      lsds chart gel
      lsds chart dynamics
      lsds chart optics
      lsds chart realism --recordings videos
      lsds chart detectors --data detection
      lsds chart estimators --data severity
      lsds chart learning --data severity --also pipe
    """


@chart.command()
@click.option("--repeats", type=click.IntRange(min=1), default=10, show_default=True, help="Passes over the frames.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the simulated run.")
@click.option("--plot", type=click.Path(dir_okay=False, path_type=Path), default=Path("frame.png"), show_default=True)
@click.option("--csv", "csv_file", metavar="FILE", help="Write the trackers' table as CSV.")
@json_option
def frame(repeats: int, seed: int, plot: Path, csv_file: str | None, json_file: str | None) -> None:
    """Time one frame from image to command, part by part, and the trackers beside their peers.

    \b
    Examples:
      lsds chart frame
      lsds chart frame --repeats 30 --json frame.json --csv frame.csv --plot frame.png
    """
    one_thread()
    from lsds_research.studies.frame.cost import measure
    from lsds_research.studies.frame.plot import plot_frame_cost

    with Progress("measuring") as progress:
        passes = count(1)
        cost = measure(seed, repeats, lambda: progress.to(next(passes), repeats))
    rows = [(p.name, f"{p.p50_us:.1f}", f"{p.p99_us:.1f}") for p in (cost.total, *cost.parts, *cost.depth)]
    trackers = [
        (s.name, "peer" if s.peer else "", f"{s.p50_us:.0f}", f"{s.p99_us:.0f}", f"{s.rms_px:.4f}",
         f"{s.kept_fraction:.4f}", f"{s.wrong_unflagged:.4f}", f"{s.jump_wrong_unflagged:.4f}", f"{s.jump_right:.4f}")
        for s in cost.trackers
    ]  # fmt: skip
    header = (
        "tracker",
        "",
        "us p50",
        "us p99",
        "RMS px",
        "kept",
        "wrong, unflagged",
        "jumps: wrong, unflagged",
        "right",
    )
    if json_file is not None:
        write_json(cost, json_file)
    if json_file != "-":
        click.echo(f"simulated frames, {cost.frames} of one run; accuracies are against the simulated truth\n")
        click.echo(table(rows, ("part", "us p50", "us p99")) + "\n\n" + table(trackers, header))
        changes = ", ".join(f"{change:.4f}" for change in cost.area_change)
        click.echo(f"\ncontact area, mean difference to the finest depth map: {changes}")
    if csv_file is not None:
        write_text(csv_text([dataclasses.asdict(s) for s in cost.trackers]), csv_file)
    try:
        plot_frame_cost(plot, cost)
    except (OSError, ValueError) as error:
        raise DataError(f"{plot}: the chart cannot be written: {error}") from error
    click.echo(f"chart: {plot}", err=json_file == "-")


@chart.command()
@click.option("--repeats", type=click.IntRange(min=1), default=5, show_default=True, help="Runs of each, in turns.")
@json_option
def scheduler(repeats: int, json_file: str | None) -> None:
    """Time the scheduler's own overhead: 60 s of a rig with four rates, beside Python's `sched`.

    \b
    Example:
      lsds chart scheduler --json scheduler.json
    """
    from lsds_research.studies import scheduler_cost

    ours, peer = scheduler_cost.measure(repeats=repeats)
    if json_file is not None:
        write_json({"lsds": ours, "sched": peer, "budget_ns": scheduler_cost.BUDGET_NS}, json_file)
    if json_file != "-":
        rows = [
            (name, f"{c.median_ns / 1e6:.1f}", f"{c.best_ns / 1e6:.1f}", f"{c.per_dispatch_ns / 1e3:.2f}")
            for name, c in (("lsds", ours), ("sched", peer))
        ]
        click.echo(table(rows, ("scheduler", "ms for 60 s, median", "best", "us a dispatch")))
        click.echo(f"budget: {scheduler_cost.BUDGET_NS / 1e6:.0f} ms")


@chart.command()
@click.option("--scene", "scenes", multiple=True, metavar="NAME", help="Measure this scene only; repeatable.")
@click.option("--reference", type=click.Path(exists=True, file_okay=False), help="Folder of reference solutions.")
@click.option("--random", type=click.IntRange(min=0, max=1000), default=12, show_default=True,
              help="Random scenes for the choosing gel.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=1000, show_default=True, help="Of the first random scene.")
@click.option("--repeats", type=click.IntRange(1, 100), default=3, show_default=True, help="Runs of each.")
@_outputs("gel.png")
def gel(
    scenes: tuple[str, ...], reference: str | None, random: int, seed: int, repeats: int, plot: Path,
    csv_file: str | None, json_file: str | None,
) -> None:  # fmt: skip
    """Chart every model of the simulated gel, on every scene: the dots' error against the time a frame takes.

    Without --reference the finest grid stands in for the truth. Grids of the choosing model are tried on random
    scenes, and their cost, audits included, compared with the cheapest grid that would have met the tolerance.

    \b
    Examples:
      lsds chart gel
      lsds chart gel --scene sphere --scene pipe --random 0 --csv gel.csv
      lsds chart gel --reference contact_reference --json gel.json
    """
    options = {
        "scenes": list(scenes), "reference": reference or "", "random": random, "seed": seed, "repeats": repeats,
    }  # fmt: skip
    study_command("gel", options, seed, plot, csv_file, json_file)


@chart.command()
@_outputs("dynamics.png")
def dynamics(plot: Path, csv_file: str | None, json_file: str | None) -> None:
    """Chart integrators of dry friction where they fail: a grip is lost for a moment and regained.

    \b
    Example:
      lsds chart dynamics --csv dynamics.csv
    """
    study_command("dynamics", {}, 0, plot, csv_file, json_file)


@chart.command()
@click.option("--scene", "scenes", multiple=True, metavar="NAME", help="Measure this scene only; repeatable.")
@click.option("--fidelity", type=click.Choice(["auto", "pad"]), default="auto", show_default=True,
              help="Gel: choosing its grid, or on cells of 0.48 mm.")  # fmt: skip
@click.option("--tolerance-um", type=click.FloatRange(0.5, 200), default=20.0, show_default=True,
              help="Of the gel that chooses its grid.")  # fmt: skip
@click.option("--repeats", type=click.IntRange(1, 100), default=3, show_default=True, help="Runs of each.")
@_outputs("optics.png")
def optics(
    scenes: tuple[str, ...], fidelity: str, tolerance_um: float, repeats: int, plot: Path, csv_file: str | None,
    json_file: str | None,
) -> None:  # fmt: skip
    """Chart what a simulated finger's frame costs, mechanics and image, and how right its colours are.

    \b
    Examples:
      lsds chart optics
      lsds chart optics --scene sphere --tolerance-um 5 --json optics.json
    """
    options = {"scenes": list(scenes), "fidelity": fidelity, "tolerance_um": tolerance_um, "repeats": repeats}
    study_command("optics", options, 0, plot, csv_file, json_file)


@chart.command()
@click.option("--recordings", required=True, type=click.Path(), metavar="FOLDER", help="Folder of real recordings.")
@click.option("--videos", type=click.IntRange(min=0), default=0, show_default=True,
              help="How many of them, spread evenly; 0 takes all.")  # fmt: skip
@click.option("--clips", type=click.IntRange(1, 10_000), default=63, show_default=True, help="Simulated clips.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the simulated clips.")
@_outputs("realism.png")
def realism(
    recordings: str, videos: int, clips: int, seed: int, plot: Path, csv_file: str | None, json_file: str | None
) -> None:
    """Lay simulated clips beside real recordings: the same tracker and features, quantiles side by side.

    In the simulated clips a hand grasps an object of the catalogue, lifts and shakes it, and it slips or holds.

    \b
    Examples:
      lsds chart realism --recordings videos
      lsds chart realism --recordings videos --videos 20 --clips 21 --plot quick.png
      lsds chart realism --recordings videos --csv realism.csv --json realism.json
    """
    options: dict[str, object] = {"recordings": recordings, "videos": videos, "clips": clips, "seed": seed}
    study_command("realism", options, seed, plot, csv_file, json_file)


def _brains(command: Callable[..., None]) -> Callable[..., None]:
    """Options of both charts of learned models."""
    data = click.option("--data", required=True, metavar="FOLDER", help="Dataset: lsds collect, or lsds reproduce.")
    most = click.option("--most", type=click.IntRange(min=500), default=20_000, show_default=True,
                        help="Windows to fit on.")  # fmt: skip
    repeats = click.option("--repeats", type=click.IntRange(1, 1000), default=10, show_default=True,
                           help="Passes over the frames that are timed.")  # fmt: skip
    seed = click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
    return data(most(repeats(seed(command))))


@chart.command()
@_brains
@_outputs("detectors.png")
def detectors(
    data: str, most: int, repeats: int, seed: int, plot: Path, csv_file: str | None, json_file: str | None
) -> None:
    """Chart detectors: accuracy on objects never seen against the time of an update. Needs the train extra.

    \b
    Examples:
      lsds chart detectors --data reproduction/data/detection
      lsds chart detectors --data detection --most 5000 --csv detectors.csv
    """
    options: dict[str, object] = {"data": data, "most": most, "repeats": repeats, "seed": seed}
    study_command("detectors", options, seed, plot, csv_file, json_file)


@chart.command()
@_brains
@_outputs("estimators.png")
def estimators(
    data: str, most: int, repeats: int, seed: int, plot: Path, csv_file: str | None, json_file: str | None
) -> None:
    """Chart estimators: R2 of speed on objects never seen against the time of an update. Needs the train extra.

    \b
    Examples:
      lsds chart estimators --data reproduction/data/severity
      lsds chart estimators --data severity --most 5000 --json estimators.json
    """
    options: dict[str, object] = {"data": data, "most": most, "repeats": repeats, "seed": seed}
    study_command("estimators", options, seed, plot, csv_file, json_file)


@chart.command()
@click.option("--data", required=True, metavar="FOLDER", help="Dataset: lsds collect, or lsds reproduce.")
@click.option("--also", default="", metavar="FOLDER", help="Another one, to be scored on besides.")
@click.option("--learner", "learners", multiple=True, metavar="NAME", default=("linear-window", "field-gru"),
              show_default=True, help="A learner; repeatable, all of one job.")  # fmt: skip
@click.option("--repeats", type=click.IntRange(1, 100), default=1, show_default=True, help="Orders of the objects.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@_outputs("learning.png")
def learning(
    data: str, also: str, learners: tuple[str, ...], repeats: int, seed: int, plot: Path, csv_file: str | None,
    json_file: str | None,
) -> None:  # fmt: skip
    """Chart the learning curve: scores on objects never seen by the number of objects to learn from.

    Needs the train extra.

    \b
    Examples:
      lsds chart learning --data severity --also pipe
      lsds chart learning --data detection --learner field-mlp --learner logistic --repeats 3
    """
    options: dict[str, object] = {
        "data": data, "also": also, "learners": list(learners), "repeats": repeats, "seed": seed,
    }  # fmt: skip
    study_command("learning", options, seed, plot, csv_file, json_file)
