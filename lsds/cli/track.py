"""`lsds track`: track slip in recordings. No device moves."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from lsds.cli.complete import backends
from lsds.cli.output import json_option, verbose_option, write_json
from lsds.cli.progress import Progress
from lsds.cli.set_option import set_option
from lsds.cli.text_table import table
from lsds.cli.threads import one_thread
from lsds.errors import DataError

MOST_LISTED_FRAMES = 3
"""Most unusable frames that the summary of a recording lists without `--verbose`."""


@click.command()
@click.argument("sources", nargs=-1, metavar="SOURCE...", required=True)
@click.option("--batch", is_flag=True, help="Track every video below the folder SOURCE, in parallel.")
@click.option("--plot", type=click.Path(dir_okay=False, path_type=Path), help="Draw the recording to this PNG.")
@click.option(
    "--tracker",
    metavar="NAME",
    shell_complete=backends("tracker"),
    help="Tracker backend: lk, centroid, dis, or a plugin's tracker.",
)
@click.option("--config", type=click.Path(dir_okay=False, path_type=Path), help="Config to start from.")
@set_option("Override one option; repeatable.")
@click.option(
    "--features",
    type=click.Choice(["baseline", "proposed", "combined", "released13", "all"]),
    default="all",
    show_default=True,
    help="Named set of features to write to the JSON.",
)
@click.option("--jobs", type=click.IntRange(min=1), default=None, help="Processes for --batch; default: one per core.")
@verbose_option
@json_option
def track(
    sources: tuple[str, ...],
    batch: bool,
    plot: Path | None,
    tracker: str | None,
    config: Path | None,
    overrides: tuple[str, ...],
    features: str,
    jobs: int | None,
    verbose: bool,
    json_file: str | None,
) -> None:
    """Track the markers of a recording; report displacement fields, features and slip.

    SOURCE is a video, a folder of images, or a glob pattern such as 'clip/*.png'. Its first frame must show the gel
    without contact. Velocities are computed from the recording's time stamps: if those are nominal and the camera was
    slower, the velocities are too high by the same factor.

    Takes: about the duration of the recording.

    Writes: nothing, except the files of --json and --plot.

    \b
    Examples:
      lsds track clip.avi --json clip.json --plot clip.png
      lsds track frames/ --set sensor.video.rate_hz=18
      lsds track clip.avi --features released13 --json clip.json
      lsds track clip.mp4 --tracker centroid --set sensor.video.timestamps=file
      lsds track --batch recordings/ --json all.json
    """
    one_thread()
    most = None if verbose else MOST_LISTED_FRAMES
    from lsds.cli import track_session

    chosen = [*overrides, *([] if tracker is None else [f"tracker.backend={tracker}"])]
    if batch:
        if features != "all":
            raise click.UsageError("--features applies to the JSON of one recording and cannot be used with --batch")
        _batch(track_session.find_videos(sources), config, chosen, jobs, json_file, plot, most)
        return
    if len(sources) != 1:
        raise click.UsageError("more than one recording given: add --batch")
    with _bar("tracking", json_file) as bar:
        result = track_session.track_one(sources[0], config, chosen, bar)
    if json_file is not None:
        write_json(result.as_dict(features), json_file)
    if json_file != "-" and result.reference is not None:
        click.echo(_table(result.summary(), most))
    if plot is not None and result.reference is not None:
        track_session.draw(result, plot)
        click.echo(f"picture: {plot}", err=json_file == "-")
    if result.error is not None:
        raise DataError(result.error) from result.cause


def _batch(
    videos: list[str],
    config: Path | None,
    overrides: list[str],
    jobs: int | None,
    json_file: str | None,
    plot: Path | None,
    most: int | None,
) -> None:
    from lsds.cli import track_session

    if plot is not None:
        raise click.UsageError("--plot draws one recording and cannot be used with --batch")
    results = []
    with Progress(f"tracking markers in {len(videos)} recordings") as progress:
        for summary in track_session.track_many(videos, config, overrides, jobs):
            results.append(summary)
            progress.to(len(results), len(videos))
    overview = track_session.overview(results)
    if json_file is not None:
        write_json({"overview": overview, "recordings": results}, json_file)
    if json_file != "-":
        click.echo(table([(key, _show(value)) for key, value in overview.items()], ("figure", "value")))
    bad = [r for r in results if r["error"] or r["failures"]]
    for r in bad:
        reasons = [r["error"]] if r["error"] else [f"{r['source']}: {f['reason']}" for f in r["failures"][:most]]
        for reason in reasons:
            click.echo(reason, err=True)
    if any(r["error"] for r in results):
        raise DataError(f"{sum(r['error'] is not None for r in results)} of {len(results)} recordings failed")


def _bar(label: str, json_file: str | None) -> Any:
    return click.progressbar(length=1, label=label, file=sys.stderr, show_eta=False)


def _table(summary: dict[str, Any], most: int | None) -> str:
    """Return the summary of a recording, with at most `most` of the unusable frames, all for None."""
    rows = [
        ("recording", summary["source"]),
        ("frames", str(summary["frames"])),
        ("duration", f"{summary['duration_s']:.2f} s ({summary['timestamps']} times)"),
        ("markers in the reference", f"{summary['markers']} on a grid of {_show(summary['grid'])}"),
        ("markers kept, mean", _share(summary["kept_mean"])),
        ("markers kept, worst frame", _share(summary["kept_min"])),
        ("largest displacement", f"{_show(summary['largest_displacement_px'])} px"),
        ("frames with slip", _share(summary["slip_fraction"])),
        ("reference renewed, at frames", ", ".join(map(str, summary["reference_renewed"])) or "-"),
        ("unusable frames", str(len(summary["failures"]))),
    ]
    rows += [("note", note) for note in summary["notes"]]
    rows += [(f"  frame {f['frame']}", f["reason"]) for f in summary["failures"][:most]]
    if hidden := len(summary["failures"]) - len(summary["failures"][:most]):
        rows.append((f"  {hidden} more", "listed with --verbose"))
    return table(rows, ("figure", "value"))


def _share(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.1f} %"


def _show(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, tuple | list):
        return " x ".join(str(v) for v in value)
    return str(value)
