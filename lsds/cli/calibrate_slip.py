"""`lsds calibrate slip`: thresholds and noise of the user's gel and camera."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from lsds.cli.finite import FiniteRange
from lsds.cli.output import json_option, require_writable, write_json
from lsds.cli.progress import Progress
from lsds.cli.set_option import set_option
from lsds.cli.text_table import table
from lsds.errors import DataError

if TYPE_CHECKING:
    from lsds.calibration.file import Tables
    from lsds.calibration.noise import ImprintNoise
    from lsds.calibration.slip import CalibratedDetector, SlipCalibration
    from lsds.calibration.watched import Phase, WatchedPhase
    from lsds.config import RigConfig
    from lsds.contracts import Detector

F = TypeVar("F", bound=Callable[..., Any])
_ALWAYS = "imprint"
"""Detector that is calibrated in addition to the rig's own one: it is untrained, so it learns only its threshold."""


def _recordings(flag: str, shows: str) -> Callable[[F], F]:
    return click.option(flag, multiple=True, metavar="RECORDING", help=f"Recording in which {shows}; repeatable.")


def _per_100(flag: str, default: float, kind: str) -> Callable[[F], F]:
    text = f"False alarms allowed per 100 {kind} frames."
    return click.option(flag, type=FiniteRange(0, 50), default=default, show_default=True, help=text)


@click.command()
@click.argument("config", required=False, type=click.Path(dir_okay=False, path_type=Path))
@_recordings("--still", "nothing moves")
@_recordings("--load", "the load changes and nothing slips")
@_recordings("--slide", "the object slides")
@click.option("--by-hand", is_flag=True, help="Move nothing: you move the object, as you are asked to.")
@set_option("Override one config key; repeatable.")
@click.option(
    "--detector", "detectors", multiple=True, metavar="NAME", help="Detector to calibrate; default: yours, and imprint."
)
@_per_100("--moving", 5.0, "moving")
@_per_100("--resting", 0.1, "still")
@click.option(
    "--seconds",
    type=FiniteRange(2, 600),
    default=None,
    help="How long each part takes by hand; default: 20.",
)
@click.option(
    "--firm-mm",
    type=FiniteRange(0, 20),
    default=None,
    help="How much closer than usual a simulated rig grips to shake; default: job.shake.closer_mm, or 2.5.",
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
    seconds: float | None,
    firm_mm: float | None,
    out: Path,
    json_file: str | None,
) -> None:
    """Calibrate the detection of slip on your own gel and camera.

    The command watches an object that rests, that is wriggled without slip, and that slides. The first two determine
    the threshold of each detector, and the error of the gel's motion between its markers. The third measures how much
    slip is detected. The command prints false alarms and detected slips before and after, and writes a file that the
    config names: calibration = ["slip.toml"].

    On your cell use --by-hand: it uses only the sensor and asks you to move the object. Or give
    recordings. Without either, a simulated rig moves by itself: it lifts and shakes an object in a firm grip, and lifts
    another in the usual grip. A real rig never moves.

    Takes: two minutes by hand, and about a minute on the simulated cell.

    Writes: slip.toml (--out), and the file of --json.

    \b
    Examples:
      lsds calibrate slip rig.toml --by-hand --out slip.toml
      lsds calibrate slip --firm-mm 3           try it on the simulated cell
      lsds calibrate slip --still s.avi --load w1.avi --load w2.avi --slide p.avi
      lsds run rig.toml --set 'calibration=["slip.toml"]'
    """
    for target in (out, json_file):
        require_writable(target)
    if out.suffix.lower() != ".toml":
        raise click.UsageError(f"--out {out}: the name must end in .toml")
    recordings: list[tuple[Phase, str]] = [("still", name) for name in still]
    recordings.extend(("load", name) for name in load)
    recordings.extend(("slide", name) for name in slide)
    _check_flags({phase for phase, _ in recordings}, by_hand=by_hand, seconds=seconds, firm_mm=firm_mm)
    from lsds.calibration.file import as_toml, noise_in, outweighed
    from lsds.calibration.slip import calibrate_slip
    from lsds.calibration.sources import built, require_recordings
    from lsds.calibration.thresholds import Budget
    from lsds.config import load_config
    from lsds.config.toml import value_text
    from lsds.registry import PluginHost
    from lsds.support.files import write_whole

    require_recordings([name for _, name in recordings])
    # An earlier calibration must not change the start of this one.
    chosen = load_config(config, overrides, without=("calibration",))
    always = PluginHost().own("detector", _ALWAYS)
    named = list(dict.fromkeys(detectors or (chosen.section("detector").backend, always)))
    asked = built(chosen, named)
    if recordings:
        phases = _recorded(recordings, config, overrides, asked)
    else:
        phases = _live(chosen, asked, by_hand=by_hand, seconds=seconds, firm_mm=firm_mm)
    result = calibrate_slip(phases, Budget(moving, resting))
    contents, noise = as_toml(result), noise_in(chosen)
    if json_file != "-":
        print_result(result, contents.tables, noise)
    if recordings and not slide:
        click.echo("it is unknown how much slip these thresholds detect: add --slide RECORDING", err=True)
    if not contents.tables:
        raise DataError(f"nothing could be calibrated, and no file is written: {'; '.join(contents.problems)}")
    problems = [*contents.problems, *outweighed(contents.tables, chosen)]
    for problem in problems:
        click.echo(f"warning: {problem}", err=True)
    write_whole(out, contents.text.encode())
    if json_file is not None:
        before = None if noise is None else noise._asdict()
        write_json({**result.as_dict(), "noise_before": before, "file": str(out), "warnings": problems}, json_file)
    if json_file != "-":
        click.echo(f"written to {out}; name it in the config: calibration = [{value_text(str(out.resolve()))}]")


def _check_flags(recorded: set[Phase], *, by_hand: bool, seconds: float | None, firm_mm: float | None) -> None:
    """Raise click.UsageError for flags that exclude each other, and for recordings without one of changing load."""
    if by_hand and recorded:
        raise click.UsageError("--by-hand watches the sensor: leave the recordings out, or leave it out")
    if seconds is not None and not by_hand:
        raise click.UsageError("--seconds is for --by-hand: add that, or leave it out")
    if firm_mm is not None and (by_hand or recorded):
        raise click.UsageError("--firm-mm is for a simulated rig that moves by itself: leave it out")
    if recorded and "load" not in recorded:
        rests = "" if "still" in recorded else "--still RECORDING and "
        raise click.UsageError(f"thresholds are learnt from changing load without slip: add {rests}--load RECORDING")


def _recorded(
    recordings: Sequence[tuple[Phase, str]],
    config: Path | None,
    overrides: Sequence[str],
    detectors: dict[str, Detector],
) -> list[WatchedPhase]:
    from lsds.calibration.sources import watched_recording

    watched: list[WatchedPhase] = []
    warnings: list[str] = []
    try:
        with Progress("watching the recordings") as progress:
            for done, (phase, name) in enumerate(recordings):
                progress.to(done, len(recordings))
                watched.append(watched_recording(name, phase, config, overrides, detectors, warnings.append))
    finally:
        for line in warnings:
            click.echo(line, err=True)
    return watched


def _live(
    config: RigConfig, detectors: dict[str, Detector], *, by_hand: bool, seconds: float | None, firm_mm: float | None
) -> list[WatchedPhase]:
    from lsds.calibration import sources

    def say(text: str) -> None:
        click.echo(text, err=True)

    if by_hand:
        if not sources.is_real(config):
            name = config.section("sensor").backend
            raise click.UsageError(f"--by-hand needs a real sensor, which '{name}' is not: leave it out")
        return sources.watched_hand(config, sources.by_hand(seconds or 20.0), detectors, say)
    if not (config.section("gripper").chosen and config.section("arm").chosen):
        raise click.UsageError("the rig has no gripper or no arm: add --by-hand, or give recordings")
    return sources.watched_rig(config, firm_mm, detectors, say)


def print_result(result: SlipCalibration, written: Tables, noise: ImprintNoise | None) -> None:
    """Print the result, and advice for the detectors that are `written`; `noise` is that of the config."""
    from lsds.calibration.slip import ENOUGH_MOVING, ENOUGH_STILL
    from lsds.calibration.thresholds import LEAST_OBJECTS

    kept = [each for each in result.detectors if each.name in written.get("detector", {})]
    rows = [row for each in result.detectors for row in _rows(each, result.slides, is_written=each in kept)]
    heads = ("detector", "threshold", "/100 moving", "/100 still", "of sliding frames", "slides noticed")
    click.echo(table(rows, heads).strip("\n"))
    click.echo(
        f"false alarms in {result.moving} moving and {result.still} still frames in which nothing slips; "
        f"allowed: {result.budget.moving:g} and {result.budget.still:g} per 100, of still ones one at least"
    )
    if not result.transfers:
        click.echo(
            f"recordings of changing load: {result.loads}; with fewer than {LEAST_OBJECTS}, each of another object, "
            "the false alarms on a new object are unknown"
        )
    for each in kept:
        if result.transfers and each.left_out[0] > result.budget.moving:
            click.echo(
                f"{each.name}: expect {each.left_out[0]:.1f} false alarms per 100 moving frames on another object, "
                f"not the {result.budget.moving:g} allowed: record more objects",
                err=True,
            )
    if result.noise is not None:
        before = "" if noise is None else f" (before: {_doubt(noise)})"
        click.echo(f"uncertainty of the gel's motion under the object: {_doubt(result.noise)}{before}")
    for each in kept:
        if not each.lowers:
            moving, still = each.answered
            click.echo(
                f"{each.name} answered in {moving} of {result.moving} moving and {still} of {result.still} still "
                f"frames; lowering its threshold takes {ENOUGH_MOVING} and {ENOUGH_STILL}: record for longer",
                err=True,
            )
    if any(each.after.noticed < each.before.noticed for each in kept):
        click.echo("fewer slides are detected than before: allow more false alarms, or record more", err=True)


def _doubt(noise: ImprintNoise) -> str:
    return f"{noise.gel_share:.0%} of the markers' motion, and {noise.still_m * 1e6:.1f} um"


def _rows(each: CalibratedDetector, slides: int, *, is_written: bool) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = [
        (
            f"{each.name}, {when}",
            f"{rates.threshold:.4g}",
            _number(rates.per_100_moving, ".1f"),
            _number(rates.per_100_still, ".2f"),
            _number(rates.found, ".2f"),
            f"{rates.noticed} of {slides}",
        )
        for when, rates in (("before", each.before), ("after" if is_written else "unwritten", each.after))
    ]
    moving, still = each.left_out
    if not math.isnan(moving):
        title = "  on another object (recordings left out in turn)"
        rows.append((title, "", _number(moving, ".1f"), _number(still, ".2f"), "", ""))
    return rows


def _number(value: float, how: str) -> str:
    return "-" if math.isnan(value) else format(value, how)
