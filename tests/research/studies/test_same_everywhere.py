"""Every campaign finds the same on one process, on two, on a local Dask cluster and on local Ray."""

from __future__ import annotations

import json

import pytest

from lsds.cli.main import main

SHORT = ("--with", "task.lift_s=0.6", "--with", "task.hold_s=0.2", "--with", "cell.simulated.fidelity=winkler")
CAMPAIGNS = {
    "search": ("search", "--random", "--runs", "8", "--most", "0", *SHORT),
    "risk": ("risk", "--plain", "--runs", "20", *SHORT),
    "certify": ("certify", "--runs", "24", *SHORT),
    "faults": ("faults", "--fault", "camera-noise", "--severity", "5", "--moment", "lift", "--seeds", "2", *SHORT),
    "stability": ("stability", "--quick", "--map", "integrators", "--map", "marker-travel"),
    "spheres": ("stability-spheres", "--quick", "--method", "fixed grip"),
    "grip": ("grip", "--random", "2", "--draw", "1001", "--controller", "belief", *SHORT),
}
TIMES = {"took_s", "cost", "frame_us", "frame_mean_us"}
"""Names of figures of the machine."""
pytestmark = [pytest.mark.usefixtures("installed_host"), pytest.mark.slow, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def dask():
    distributed = pytest.importorskip("distributed", reason="needs the extra cluster")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, scheduler_port=0
    ) as cluster:
        yield cluster.scheduler_address


def figures(folder, command, place):
    """Return what a campaign writes at a place, without the figures of the machine."""
    file = folder / f"{len(list(folder.iterdir()))}.json"
    assert main(["study", *command, *place, "--no-plot", "--json", str(file)]) == 0
    return without_times(json.loads(file.read_text(encoding="utf-8")))


def without_times(value):
    if isinstance(value, dict):
        return {name: without_times(own) for name, own in value.items() if name not in TIMES}
    return [without_times(own) for own in value] if isinstance(value, list) else value


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", CAMPAIGNS)
def test_the_place_does_not_change_the_figures(name, tmp_path, dask):
    here = figures(tmp_path, CAMPAIGNS[name], ("--jobs", "1"))
    assert figures(tmp_path, CAMPAIGNS[name], ("--jobs", "2")) == here
    assert figures(tmp_path, CAMPAIGNS[name], ("--cluster", dask)) == here
    pytest.importorskip("ray", reason="needs the extra ray")
    assert figures(tmp_path, CAMPAIGNS[name], ("--cluster", "ray")) == here
