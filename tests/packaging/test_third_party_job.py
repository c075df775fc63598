"""A third-party job from its own wheel: it lifts, places and releases using only the public contract."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

PROJECT = Path(__file__).parent / "acme_place"


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder with the wheel's content, as pip unpacks it."""
    pytest.importorskip("build")
    out, site = tmp_path_factory.mktemp("wheel"), tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(out), str(PROJECT)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = out.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    return site


def lsds(site, *arguments):
    path = os.pathsep.join([str(site), *filter(None, [os.environ.get("PYTHONPATH", "")])])
    done = subprocess.run(
        [sys.executable, "-m", "lsds.cli.main", *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": path},
    )
    return done.returncode, done.stdout, done.stderr


def test_it_is_listed_with_its_options(installed):
    code, out, err = lsds(installed, "plugins", "--kind", "job")
    assert code == 0, err
    assert "acme-place" in out
    code, out, err = lsds(installed, "run", "--set", "job.backend=place", "--set", "job.place.hight_m=0.1", "--no-plot")
    assert code == 2
    assert "job.place.hight_m: unknown key (did you mean 'height_m'?)" in err


def test_it_lifts_places_and_lets_go(installed):
    chosen = ["job.backend=place", "cell.simulated.fidelity=winkler", "task.grip_aperture_m=0.0225"]
    sets = [part for setting in chosen for part in ("--set", setting)]
    code, out, err = lsds(installed, "run", "--json", "-", "--no-plot", *sets)
    assert code == 0, err
    summary = json.loads(out)
    assert summary["fault"] is None
    assert summary["outcome"] == "released"
    assert summary["backends"]["job"] == "place"
    assert summary["aperture_m"]["at_end"] < 0.0235
