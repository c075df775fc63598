"""`lsds config`: the schema of a config, an example, and a check of a file."""

from __future__ import annotations

from pathlib import Path

import click

from lsds.cli.output import json_option, require_writable, to_json, write_json, write_text
from lsds.cli.set_option import set_option
from lsds.cli.text_table import table


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def config() -> None:
    """Write a config to start from, check one, or print the schema for an editor.

    \b
    Examples:
      lsds config example > rig.toml
      lsds config check rig.toml
      lsds config schema -o rig.schema.json
    """


@config.command()
@click.argument("file", type=click.Path(dir_okay=False, path_type=Path))
@set_option("Override one option; repeatable.")
@json_option
def check(file: Path, overrides: tuple[str, ...], json_file: str | None) -> None:
    """Check a config as a whole: keys, values, backends and their options. Nothing is connected.

    All problems are listed together, each with its place and a remedy; the exit code is 2 then.

    Takes: a second.

    Writes: nothing, except the file of --json.

    \b
    Examples:
      lsds config check rig.toml
      lsds config check rig.toml --set detector.backend=imprint
    """
    require_writable(json_file)
    from lsds.config import load_config
    from lsds.contracts.kinds import CONFIG_KINDS

    checked = load_config(file, overrides)
    chosen = {name: section.backend for name, section in checked.fingers.items()}
    rows = [(f"sensor {name}" if checked.sensors else "sensor", backend) for name, backend in chosen.items()]
    rows += [(kind, checked.section(kind).backend) for kind in CONFIG_KINDS if kind != "sensor"]
    if json_file is not None:
        write_json({"file": str(file), "valid": True, "backends": dict(rows)}, json_file)
    if json_file != "-":
        click.echo(table(rows, ("kind", "backend")))
        click.echo(f"{file}: valid")


@config.command()
@click.option("-o", "--output", default="-", metavar="FILE", help="Write to FILE instead of stdout.")
def schema(output: str) -> None:
    """Print the JSON schema (draft 2020-12) of a config, with the options of every installed backend.

    Takes: two seconds.

    Writes: to stdout, or to the file of --output.

    \b
    Examples:
      lsds config schema -o rig.schema.json

    \b
    Editors that check TOML read the schema's name from the config's first line:
      #:schema rig.schema.json
    or from the key "$schema" = "rig.schema.json"; lsds ignores both.
    """
    # Imported here: building pydantic models would slow down `--help`.
    from lsds.config import json_schema

    write_text(to_json(json_schema()), output)


@config.command()
@click.option("-o", "--output", default="-", metavar="FILE", help="Write to FILE instead of stdout.")
def example(output: str) -> None:
    """Print the default config as commented TOML: a config to start from.

    Takes: two seconds.

    Writes: to stdout, or to the file of --output.

    \b
    Examples:
      lsds config example -o rig.toml
    """
    from lsds.config.example import example_config

    write_text(example_config(), output)
