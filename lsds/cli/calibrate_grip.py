"""`lsds calibrate grip`: newtons of one's own gel, from a known weight."""

from __future__ import annotations

from pathlib import Path

import click

from lsds.cli.output import json_option, require_writable, table, write_json

STANDARD_GRAVITY = 9.80665


@click.command()
@click.argument("config", required=False, type=click.Path(dir_okay=False, path_type=Path))
@click.option(
    "--mass-g",
    type=click.FloatRange(1, 20_000),
    default=None,
    help="Mass of the object that is lifted; a simulated cell knows its own.",
)
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Override one config key; repeatable.")
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    default=Path("grip.toml"),
    show_default=True,
    help="File to write.",
)
@json_option
def grip(
    config: Path | None, mass_g: float | None, overrides: tuple[str, ...], out: Path, json_file: str | None
) -> None:
    """Calibrate the load: how many newtons the dots' displacement is on your own gel.

    The rig lifts an object of known mass, as `lsds run` does, and holds it: the arm moves. What the dots show then is
    set against its weight. Two fingers with sensors share the weight; with one sensor the other finger carries half.
    Holding without slip needs no calibration: it is for loads and limits in newtons. The file is named by the config:
    calibration = ["grip.toml"].

    \b
    Examples:
      lsds calibrate grip rig.toml --mass-g 320
      lsds calibrate grip                                   try it on the simulated cell
      lsds calibrate grip rig.toml --mass-g 320 --out left.toml --json -
    """
    for target in (out, json_file):
        require_writable(target)
    if out.suffix.lower() != ".toml":
        raise click.UsageError(f"--out {out}: the name must end in .toml")
    from lsds.calibration.grip import lifted_weight
    from lsds.config import load_config
    from lsds.config.toml import value_text
    from lsds.files import write_whole

    def say(text: str) -> None:
        click.echo(text, err=True)

    # What an earlier calibration found is not where this one begins.
    result = lifted_weight(
        load_config(config, overrides, without=("calibration",)),
        None if mass_g is None else mass_g * 1e-3 * STANDARD_GRAVITY,
        say,
    )
    write_whole(out, result.toml().encode())
    if json_file is not None:
        write_json({**result.as_dict(), "file": str(out)}, json_file)
    if json_file != "-":
        rows = [
            ("weight", f"{result.weight_n:.3f} N"),
            ("shear stiffness", f"{result.shear_kpa_mm:.2f} ± {result.shear_std_kpa_mm:.2f} kPa/mm"),
            ("before", f"{result.before_kpa_mm:.2f} kPa/mm"),
            ("frames", str(result.frames)),
            *((f"share of finger {name}", f"{share:.2f}") for name, share in result.shares.items()),
        ]
        click.echo(table(rows, ("", "")).strip("\n"))
        click.echo(f"written to {out}; name it in the config: calibration = [{value_text(str(out.resolve()))}]")
