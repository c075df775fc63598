"""The image runs the README's first command, from files that it copies."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import click
import pytest

from lsds.cli.main import cli

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def steps():
    """The instructions of the Containerfile in their order, each with its arguments."""
    lines = (ROOT / "Containerfile").read_text(encoding="utf-8").splitlines()
    return [tuple(line.split(" ", 1)) for line in lines if line and not line.startswith("#")]


def arguments(steps, instruction):
    return [given for name, given in steps if name == instruction]


def test_the_image_runs_the_first_command_of_the_readme(steps):
    command = re.search(r"```sh\n(.+)\n```", (ROOT / "README.md").read_text(encoding="utf-8"))[1]
    (install,) = arguments(steps, "RUN")
    start = json.loads(arguments(steps, "ENTRYPOINT")[0]) + json.loads(arguments(steps, "CMD")[0])
    (folder,) = arguments(steps, "WORKDIR")
    assert arguments(steps, "ENV") == [f'PATH="{folder}/.venv/bin:$PATH"']
    assert f"{install} && .venv/bin/{' '.join(start)}" == command


def test_it_copies_everything_that_the_build_needs_before_it_installs(steps):
    before = steps[: next(k for k, (name, _) in enumerate(steps) if name == "RUN")]
    copied = {source for given in arguments(before, "COPY") for source in given.split()[:-1]}
    assert [source for source in copied if not (ROOT / source).exists()] == []
    project = PROJECT["project"]
    packages = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
    needed = {"pyproject.toml", "constraints.txt", project["readme"], *project["license-files"]}
    assert needed | {package.split("/")[0] for package in packages} <= copied


def test_its_python_is_one_that_the_project_supports(steps):
    (image,) = arguments(steps, "FROM")
    version = re.fullmatch(r"docker\.io/library/python:(3\.\d+)-slim", image)[1]
    assert f"Programming Language :: Python :: {version}" in PROJECT["project"]["classifiers"]


def test_its_arguments_are_those_of_a_command_that_needs_no_others(steps):
    (name, *given) = json.loads(arguments(steps, "CMD")[0])
    assert json.loads(arguments(steps, "ENTRYPOINT")[0]) == ["lsds"]
    assert PROJECT["project"]["scripts"]["lsds"] == "lsds.cli.main:program"
    command = cli.get_command(click.Context(cli), name)
    assert command is not None
    # Parses the arguments and does not run the command.
    assert command.make_context(name, given).params


def test_the_extra_that_it_installs_exists(steps):
    (install,) = arguments(steps, "RUN")
    extras = re.search(r"'\.\[([\w,]+)\]'", install)[1].split(",")
    assert set(extras) <= PROJECT["project"]["optional-dependencies"].keys()
