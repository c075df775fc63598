"""`lsds schema`: the JSON schema of a config, or a config to start from."""

from __future__ import annotations

import click

from lsds.cli.output import to_json, write_text


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("-o", "--output", default="-", metavar="FILE", help="Write to FILE instead of stdout.")
@click.option("--example", is_flag=True, help="Print the default config as commented TOML.")
def schema(output: str, example: bool) -> None:
    """Print the JSON schema (draft 2020-12) of a config, with the options of every installed backend.

    \b
    Examples:
      lsds schema -o rig.schema.json         schema for an editor to check rig.toml with
      lsds schema --example -o rig.toml      a config to start from

    \b
    Editors that check TOML read the schema's name from the first line of the config:
      #:schema rig.schema.json
    or from the key "$schema" = "rig.schema.json"; lsds ignores both.
    """
    # Imported here: building pydantic models would slow down `--help`.
    from lsds.config import json_schema
    from lsds.config.example import example_config

    write_text(example_config() if example else to_json(json_schema()), output)
