"""A third-party distribution: `lsds` runs its study and its command, and its broken plugin affects neither."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

FILES = {
    "acme_lsds/__init__.py": "",
    "acme_lsds/manifest.py": """
from lsds.contracts import BackendSpec
from lsds.registry import hookimpl


@hookimpl
def lsds_backends():
    return [
        BackendSpec("study", "fall", "acme_lsds.fall:Fall", "acme_lsds.fall:FallOptions", summary="how far it falls"),
        BackendSpec("command", "acme-hello", "acme_lsds.hello:hello", summary="says hello"),
    ]
""",
    "acme_lsds/broken.py": "raise RuntimeError('not today')",
    "acme_lsds/hello.py": """
import click


@click.command()
def hello():
    click.echo("hello from acme")
""",
    "acme_lsds/fall.py": """
from lsds.contracts import StudyResult
from pydantic import BaseModel, Field


class FallOptions(BaseModel):
    times_s: list[float] = Field(default=[1.0], description="time to fall, s", json_schema_extra={"flag": "--time-s"})
    gravity_m_s2: float = Field(default=9.81, gt=0, description="gravity")


class Fall:
    def __init__(self, options, context):
        self.options = options

    def run(self, tick):
        rows = [{"time_s": t, "m": self.options.gravity_m_s2 * t**2 / 2} for t in self.options.times_s]
        return StudyResult("Free fall", (("time_s", "s", ".1f"), ("m", "fallen m", ".2f")), rows)
""",
    "acme_lsds-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: acme-lsds\nVersion: 1.0\n",
    "acme_lsds-1.0.dist-info/entry_points.txt": "[lsds]\nacme = acme_lsds.manifest\nacme-broken = acme_lsds.broken\n",
}


@pytest.fixture(scope="module")
def lsds(tmp_path_factory):
    """Return a function that runs `lsds` in a separate process, with that distribution installed."""
    folder = tmp_path_factory.mktemp("site")
    for name, text in FILES.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    path = os.pathsep.join([str(folder), *sys.path])

    def run(*arguments, code=0):
        done = subprocess.run(
            [sys.executable, "-m", "lsds.cli.main", *arguments],
            capture_output=True,
            text=True,
            check=False,
            cwd=folder,
            env={**os.environ, "PYTHONPATH": path},
        )
        assert done.returncode == code, done.stdout + done.stderr
        assert "Traceback" not in done.stderr
        return done.stdout

    return run


def test_its_study_runs_by_flags_and_by_set(lsds):
    assert "how far it falls" in lsds("study")
    assert "--time-s" in lsds("study", "fall", "--help")
    by_flags = json.loads(lsds("study", "fall", "--time-s", "1", "--time-s", "2", "--gravity-m-s2", "2", "--json", "-"))
    assert by_flags["rows"] == [{"time_s": 1, "m": 1}, {"time_s": 2, "m": 4}]
    by_set = lsds("study", "fall", "--set", "times_s=[1.0, 2.0]", "--set", "gravity_m_s2=2.0", "--json", "-")
    assert json.loads(by_set) == by_flags
    lsds("study", "fall", "--set", "gravity_m_s2=-1.0", code=2)


def test_its_command_runs_and_a_broken_one_is_only_listed(lsds):
    assert "says hello" in lsds("--help")
    assert lsds("acme-hello") == "hello from acme\n"
    assert "RuntimeError: not today" in lsds("plugins")
