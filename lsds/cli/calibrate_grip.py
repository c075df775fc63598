"""`lsds calibrate grip`: shear stiffness of the user's gel from a known weight, and its friction."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lsds.cli.finite import FiniteRange
from lsds.cli.output import json_option, require_writable, write_json
from lsds.cli.set_option import set_option
from lsds.cli.text_table import table

if TYPE_CHECKING:
    from lsds.calibration.friction import FrictionCalibration
    from lsds.calibration.grip import GripCalibration

STANDARD_GRAVITY = 9.80665
"""Standard gravity, m/s^2, by definition."""


@click.command()
@click.argument("config", required=False, type=click.Path(dir_okay=False, path_type=Path))
@click.option(
    "--mass-g",
    type=FiniteRange(1, 20_000),
    default=None,
    help="Mass of the object that is lifted; a simulated cell knows its own.",
)
@set_option("Override one config key; repeatable.")
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    default=Path("grip.toml"),
    show_default=True,
    help="File to write.",
)
@click.option(
    "--slide",
    "slides",
    is_flag=True,
    help="Calibrate friction instead: the fingers move along an object that stands firmly or is clamped.",
)
@json_option
def grip(
    config: Path | None,
    mass_g: float | None,
    overrides: tuple[str, ...],
    out: Path,
    slides: bool,
    json_file: str | None,
) -> None:
    """Calibrate the load in newtons: the shear stiffness of your own gel.

    The arm moves: the rig lifts an object of known mass, as `lsds run` does, and holds it. The command compares the
    markers' displacement with the weight. Two fingers with sensors share the weight; with one sensor, the other finger
    carries half. Loads and limits in newtons need this calibration; holding without slip does not. The same lift
    measures the delay of the fingers and the scatter of the load.

    With --slide the fingers move along a fixed object, as in the job `slide`. The ratio of static to kinetic friction
    is the load at which the object starts to slide divided by the load while it slides.

    The config names the files: calibration = ["grip.toml", "friction.toml"].

    Takes: as long as one lift, some 20 s.

    Writes: the file of --out, and that of --json.

    \b
    Examples:
      lsds calibrate grip rig.toml --mass-g 320
      lsds calibrate grip                          try it on the simulated cell
      lsds calibrate grip rig.toml --mass-g 320 --out left.toml --json -
      lsds calibrate grip rig.toml --slide --out friction.toml
    """
    for target in (out, json_file):
        require_writable(target)
    if out.suffix.lower() != ".toml":
        raise click.UsageError(f"--out {out}: the name must end in .toml")
    from lsds.calibration.friction import FrictionCalibration, slid_friction
    from lsds.calibration.grip import lifted_weight
    from lsds.config import load_config
    from lsds.config.toml import value_text
    from lsds.support.files import write_whole

    def say(text: str) -> None:
        click.echo(text, err=True)

    # An earlier calibration must not change the start of this one.
    loaded = load_config(config, overrides, without=("calibration",))
    result: FrictionCalibration | GripCalibration
    if slides:
        if mass_g is not None:
            raise click.UsageError("--slide needs no --mass-g: it measures a ratio of loads")
        result = slid_friction(loaded, say)
    else:
        result = lifted_weight(loaded, None if mass_g is None else mass_g * 1e-3 * STANDARD_GRAVITY, say)
    write_whole(out, result.toml().encode())
    if json_file is not None:
        write_json({**result.as_dict(), "file": str(out)}, json_file)
    if json_file != "-":
        rows = _friction_rows(result) if isinstance(result, FrictionCalibration) else _load_rows(result)
        click.echo(table(rows, ("", "")).strip("\n"))
        click.echo(f"written to {out}; name it in the config: calibration = [{value_text(str(out.resolve()))}]")


def _load_rows(found: GripCalibration) -> list[tuple[str, str]]:
    return [
        ("weight", f"{found.weight_n:.3f} N"),
        ("shear stiffness", f"{found.shear_kpa_mm:.2f} ± {found.shear_std_kpa_mm:.2f} kPa/mm"),
        ("before", f"{found.before_kpa_mm:.2f} kPa/mm"),
        ("scatter of the load", f"{found.noise:.1%}"),
        ("the fingers answer after", "unknown" if math.isnan(found.answer_s) else f"{1e3 * found.answer_s:.0f} ms"),
        ("frames", str(found.frames)),
        *((f"share of finger {name}", f"{share:.2f}") for name, share in found.shares.items()),
    ]


def _friction_rows(found: FrictionCalibration) -> list[tuple[str, str]]:
    return [
        ("load when it gave way", f"{found.static_n:.3f} N"),
        ("load while it slid", f"{found.kinetic_n:.3f} N"),
        ("static over kinetic friction", f"{found.ratio:.2f}"),
        ("frames", str(found.frames)),
    ]
