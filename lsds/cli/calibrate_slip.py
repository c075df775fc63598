"""`lsds calibrate slip`: thresholds and noise of one's own gel and camera."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from lsds.cli.output import json_option, require_writable, table, write_json
from lsds.cli.progress import Progress

if TYPE_CHECKING:
    from lsds.calibration.slip import CalibratedDetector, SlipCalibration
    from lsds.calibration.watched import Phase, WatchedPhase
    from lsds.config import RigConfig
    from lsds.contracts import Detector

F = TypeVar("F", bound=Callable[..., Any])
_ALWAYS = "imprint"
"""Calibrated beside the rig's own detector: it is untrained, so its threshold is all that it can learn."""


def _recordings(flag: str, shows: str) -> Callable[[F], F]:
    return click.option(flag, multiple=True, metavar="RECORDING", help=f"Recording in which {shows}; repeatable.")


def _per_100(flag: str, default: float, kind: str) -> Callable[[F], F]:
    text = f"False alarms allowed per 100 {kind} frames."
    return click.option(flag, type=click.FloatRange(0, 50), default=default, show_default=True, help=text)


@click.command()
@click.argument("config", required=False, type=click.Path(dir_okay=False, path_type=Path))
@_recordings("--still", "nothing moves")
@_recordings("--load", "the load changes and nothing slips")
@_recordings("--slide", "the object slides")
@click.option("--by-hand", is_flag=True, help="Move nothing: you move the object, as you are asked to.")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Override one config key; repeatable.")
@click.option(
    "--detector", "detectors", multiple=True, metavar="NAME", help="Detector to calibrate; default: yours, and imprint."
)
@_per_100("--moving", 5.0, "moving")
@_per_100("--resting", 0.1, "still")
@click.option(
    "--seconds",
    type=click.FloatRange(2, 600),
    default=20.0,
    show_default=True,
    help="How long each part takes by hand.",
)
@click.option(
    "--firm-mm",
    type=click.FloatRange(0, 20),
    default=2.5,
    show_default=True,
    help="How much closer than its usual grip the rig grips where nothing may slip.",
)
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    default=Path("slip.toml"),
    show_default=True,
    help="File to write.",
)
@json_option
def slip(
    config: Path | None,
    still: tuple[str, ...],
    load: tuple[str, ...],
    slide: tuple[str, ...],
    by_hand: bool,
    overrides: tuple[str, ...],
    detectors: tuple[str, ...],
    moving: float,
    resting: float,
    seconds: float,
    firm_mm: float,
    out: Path,
    json_file: str | None,
) -> None:
    """Calibrate the detection of slip on your own gel and camera.

    It watches an object that rests, that is wriggled without slipping, and that slides. From the first two it learns
    the threshold of each detector, and how far the gel goes another way than its dots; the third tells what is found.
    It prints false alarms and slips found, before and after, and writes a file that the config names:
    calibration = ["slip.toml"].

    On your cell use --by-hand: only the sensor is used, and you move the object as you are asked to; that takes two
    minutes. Or give recordings. Without either, a simulated rig moves by itself: it lifts and shakes an object in a
    firm grip, and lifts another in the usual one. A real rig is never moved.

    \b
    Examples:
      lsds calibrate slip rig.toml --by-hand --out slip.toml
      lsds calibrate slip --firm-mm 3                              try it on the simulated cell
      lsds calibrate slip --still s.avi --load w1.avi --load w2.avi --slide p.avi
      lsds run rig.toml --set 'calibration=["slip.toml"]'
    """
    for target in (out, json_file):
        require_writable(target)
    if out.suffix.lower() != ".toml":
        raise click.UsageError(f"--out {out}: the name must end in .toml")
    from lsds.calibration.file import as_toml
    from lsds.calibration.slip import calibrate_slip
    from lsds.calibration.sources import built
    from lsds.calibration.thresholds import Budget
    from lsds.config import load_config
    from lsds.config.toml import value_text
    from lsds.files import write_whole

    if by_hand and (still or load or slide):
        raise click.UsageError("--by-hand watches the sensor: leave the recordings out, or leave it out")
    # What an earlier calibration found is not where this one begins.
    chosen = load_config(config, overrides, without=("calibration",))
    named = list(dict.fromkeys(detectors or (chosen.section("detector").backend, _ALWAYS)))
    asked = built(chosen, named)
    recordings: list[tuple[Phase, str]] = [("still", name) for name in still]
    recordings += [("load", name) for name in load] + [("slide", name) for name in slide]
    if recordings:
        phases = _recorded(recordings, config, overrides, asked)
    else:
        phases = _live(chosen, asked, by_hand=by_hand, seconds=seconds, firm_mm=firm_mm)
    result = calibrate_slip(phases, Budget(moving, resting))
    if json_file != "-":
        _print(result)
    text, problems = as_toml(result)
    for name in named:
        own = name.rpartition(":")[2]
        if "threshold" in chosen.section("detector").tables.get(own, {}):
            problems.append(f"the config sets detector.{own}.threshold itself, which counts more: take it out")
    for problem in problems:
        click.echo(f"warning: {problem}", err=True)
    write_whole(out, text.encode())
    if json_file is not None:
        write_json({**result.as_dict(), "file": str(out), "warnings": problems}, json_file)
    if json_file != "-":
        click.echo(f"written to {out}; name it in the config: calibration = [{value_text(str(out.resolve()))}]")


def _recorded(
    recordings: Sequence[tuple[Phase, str]],
    config: Path | None,
    overrides: Sequence[str],
    detectors: dict[str, Detector],
) -> list[WatchedPhase]:
    from lsds.calibration.sources import watched_recording

    told = []
    with Progress("watching the recordings") as progress:
        for done, (phase, name) in enumerate(recordings):
            progress.to(done, len(recordings))
            told.append(watched_recording(name, phase, config, overrides, detectors))
    return told


def _live(
    config: RigConfig, detectors: dict[str, Detector], *, by_hand: bool, seconds: float, firm_mm: float
) -> list[WatchedPhase]:
    from lsds.calibration import sources

    def say(text: str) -> None:
        click.echo(text, err=True)

    if by_hand:
        return sources.watched_hand(config, sources.by_hand(seconds), detectors, say)
    if not (config.section("gripper").chosen and config.section("arm").chosen):
        raise click.UsageError("the rig has no gripper or no arm: add --by-hand, or give recordings")
    return sources.watched_rig(config, firm_mm, detectors, say)


def _print(result: SlipCalibration) -> None:
    rows = [row for each in result.detectors for row in _rows(each, result.slides)]
    heads = ("detector", "threshold", "/100 moving", "/100 still", "of sliding frames", "slides noticed")
    click.echo(table(rows, heads).strip("\n"))
    click.echo(
        f"false alarms in {result.moving} moving and {result.still} still frames in which nothing slips; "
        f"allowed: {result.budget.moving:g} and {result.budget.still:g} per 100, of still ones one at least"
    )
    if result.noise is not None:
        share, still_m = result.noise
        click.echo(
            f"the gel under the object is in doubt by {share:.0%} of the dots' motion, and {still_m * 1e6:.1f} um"
        )
    for each in result.detectors:
        if not each.lowers:
            click.echo(f"{each.name} answered in too few frames to lower its threshold: record for longer", err=True)
    if any(each.after.noticed < each.before.noticed for each in result.detectors):
        click.echo("slides are missed now that were noticed before: allow more false alarms, or record more", err=True)


def _rows(each: CalibratedDetector, slides: int) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = [
        (
            f"{each.name}, {when}",
            f"{told.threshold:.4g}",
            _number(told.per_100_moving, ".1f"),
            _number(told.per_100_still, ".2f"),
            _number(told.found, ".2f"),
            f"{told.noticed} of {slides}",
        )
        for when, told in (("before", each.before), ("after", each.after))
    ]
    moving, still = each.left_out
    if not math.isnan(moving):
        rows.append(("  recordings left out in turn", "", _number(moving, ".1f"), _number(still, ".2f"), "", ""))
    return rows


def _number(value: float, how: str) -> str:
    return "-" if math.isnan(value) else format(value, how)
