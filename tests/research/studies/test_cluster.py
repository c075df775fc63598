"""Work on a cluster: a local one of two workers gives the figures that this machine gives."""

from __future__ import annotations

import json
import os
import sys
import types

import pytest
from lsds_research.cluster import shared_out

from lsds.cli.main import main
from lsds.errors import DataError, MissingExtra

LIFT = ["study", "grip", "--controller", "belief", "--object", "pvc-pipe", "--squeeze-mm", "1.0"]
LIFT += ["--speed", "0.08", "--speed", "0.06", "--with", "task.lift_s=0.6", "--with", "task.hold_s=0.2"]


def figures(folder, *place):
    """Return the runs of the study at a place; the figures of the machine differ."""
    file = folder / f"{len(list(folder.iterdir()))}.json"
    assert main([*LIFT, *place, "--json", str(file)]) == 0
    runs = sorted(json.loads(file.read_text())["runs"], key=lambda run: run["speed_m_s"])
    return [{name: run[name] for name in run.keys() - {"frame_us", "cost"}} for run in runs]


@pytest.mark.filterwarnings("ignore")
def test_two_dask_workers_find_what_this_machine_finds(tmp_path, installed_host):
    distributed = pytest.importorskip("distributed")
    here = figures(tmp_path, "--jobs", "1")
    assert len(here) == 2
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, scheduler_port=0
    ) as cluster:
        assert figures(tmp_path, "--jobs", "1", "--cluster", cluster.scheduler_address) == here


def deadly(number):
    return number * number if number != 2 else os._exit(1)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.timeout(120)
def test_a_worker_that_dies_costs_its_own_item_only():
    distributed, dask = pytest.importorskip("distributed"), pytest.importorskip("dask")
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
    ):
        found = dict(shared_out(deadly, range(5), 1, cluster.scheduler_address))
    assert found == {0: 0, 1: 1, 2: None, 3: 9, 4: 16}


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.filterwarnings("ignore")
def test_ray_and_two_processes_find_what_one_process_finds(tmp_path, installed_host):
    pytest.importorskip("ray", reason="needs the extra ray")
    here = figures(tmp_path, "--jobs", "1")
    assert figures(tmp_path, "--jobs", "2") == here
    assert figures(tmp_path, "--cluster", "ray") == here


def test_ray_is_joined_and_left(monkeypatch):
    """Ray itself is large: a stand-in shows what is asked of it."""
    calls = []
    ray = types.ModuleType("ray")
    ray.init = lambda **options: calls.append(options["address"])
    ray.shutdown = lambda: calls.append("left")
    ray.remote = lambda work: types.SimpleNamespace(remote=lambda *arguments: lambda: work(*arguments))
    ray.wait = lambda waiting: (waiting[-1:], waiting[:-1])
    ray.get = lambda ready: ready()
    ray.exceptions = types.SimpleNamespace(WorkerCrashedError=RuntimeError)
    ray.__spec__ = types.SimpleNamespace(name="ray")
    monkeypatch.setitem(sys.modules, "ray", ray)
    assert list(shared_out(abs, [-1, 2, -3], 1, "ray://head:10001")) == [(-3, 3), (2, 2), (-1, 1)]
    assert calls == ["ray://head:10001", "left"]


@pytest.mark.filterwarnings("ignore")
def test_a_cluster_that_is_none_is_one_line():
    pytest.importorskip("distributed")
    with pytest.raises(DataError, match="name tcp://HOST:PORT"):
        list(shared_out(abs, [1], 1, "moon"))


def test_a_missing_library_names_its_extra(monkeypatch):
    monkeypatch.setattr("lsds.support.extras.importable", lambda name: False)
    with pytest.raises(MissingExtra, match=r"lsds-tactile\[cluster\]"):
        list(shared_out(abs, [1], 1, "tcp://host:1"))
