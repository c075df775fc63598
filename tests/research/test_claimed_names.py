"""Backends that a study chooses by itself are those of lsds, even if a plugin claims their names."""

from __future__ import annotations

from importlib.metadata import EntryPoint
from types import SimpleNamespace

import pytest
from fake_cell import plugin
from lsds_research.collecting.campaign import PRESETS
from lsds_research.evaluation.fitting import Model
from lsds_research.recording_engine import recording_engine
from lsds_research.reproduce.jobs import planned as reproduced
from lsds_research.studies.faults.options import FaultsOptions
from lsds_research.studies.faults.study import _planned as faults_planned
from lsds_research.studies.loop.options import LoopOptions
from lsds_research.studies.loop.study import own_options as own_loop
from lsds_research.studies.slide import Slid, SlideOptions
from lsds_research.study_backends import with_own_defaults

from lsds.config import load_config
from lsds.contracts import BackendSpec
from lsds.errors import ConfigError, DataError, PluginConflict
from lsds.registry import PluginHost
from lsds.registry import host as host_module
from lsds.registry.backends import OWN_DISTRIBUTION
from lsds.runtime.rig import Rig

PACKAGES = ("plugins", "drivers", "mocks", "research")
CLAIMED = {
    "sensor": ["video"],
    "pose_source": ["mock-truth-camera"],
    "tracker": ["lk", "centroid", "dis"],
    "detector": ["fused", "imprint", "threshold", "rigid-residual"],
    "estimator": ["fused", "imprint", "field"],
    "controller": ["belief", "pd"],
    "job": ["slide"],
    "fault": ["camera-noise"],
    "learner": ["random-forest", "lstm", "logistic"],
}


@pytest.fixture(autouse=True)
def _claimed(monkeypatch):
    """Install the first-party plugins as those of lsds, and a plugin that claims the names that studies use."""
    entry_points = [
        SimpleNamespace(
            name=f"lsds-{package}",
            dist=SimpleNamespace(name=OWN_DISTRIBUTION),
            load=EntryPoint(package, f"lsds_{package}.manifest", "lsds").load,
        )
        for package in PACKAGES
    ]
    acme = plugin(*(BackendSpec(kind, name, "no_module:a") for kind, names in CLAIMED.items() for name in names))
    entry_points.append(SimpleNamespace(name="acme", dist=SimpleNamespace(name="acme"), load=lambda: acme))
    monkeypatch.setattr(host_module, "installed_entry_points", lambda group: entry_points)


def test_names_are_claimed():
    with pytest.raises(PluginConflict):
        PluginHost().find("job", "slide")


def test_the_study_of_slides_runs_the_job_and_the_controller_of_lsds():
    options = with_own_defaults(PluginHost(), SlideOptions(), {"controllers": "controller"})
    (controller,) = options.controllers
    config = load_config(None, Slid(controller, "can", 0.01, 0.0, 1.4, 1).overrides())
    assert config.job.backend == "lsds:slide"
    assert config.controller.backend == "lsds:belief"
    with Rig(config) as rig:
        assert rig.controller is not None


def test_names_that_the_user_wrote_stay():
    options = with_own_defaults(PluginHost(), SlideOptions(controllers=["pd"]), {"controllers": "controller"})
    assert options.controllers == ["pd"]
    with pytest.raises(ConfigError, match="choose one: 'acme:pd' or 'lsds:pd'"):
        load_config(None, Slid("pd", "can", 0.01, 0.0, 1.4, 1).overrides())


def test_the_study_of_faults_runs_the_backends_of_lsds():
    cases = faults_planned(FaultsOptions(faults=["gripper-offset"], severities=[3], moments=["lift"]), 0)
    assert {case.controller for case in cases} == {"lsds:belief"}
    assert {case.detector for case in cases} == {"lsds:fused"}
    with pytest.raises(PluginConflict):
        faults_planned(FaultsOptions(controllers=["belief"]), 0)


def test_a_claimed_fault_keeps_its_severities():
    cases = faults_planned(FaultsOptions(severities=[2, 3], moments=["lift"]), 0)
    assert {case.severity for case in cases if case.fault == "lsds:camera-noise"} == {2, 3}


@pytest.mark.parametrize("prefix", ["lsds", "lsds-tactile"])
def test_a_fault_with_either_name_of_lsds_has_its_severities(prefix):
    named = f"{prefix}:camera-noise"
    cases = faults_planned(FaultsOptions(faults=[named], severities=[2, 3], moments=["lift"]), 0)
    assert {case.severity for case in cases if case.fault == named} == {2, 3}


def test_the_study_of_whole_configurations_compares_backends_of_lsds():
    options = own_loop(PluginHost(), LoopOptions(trackers=["acme:lk"]))
    assert options.trackers == ["acme:lk"]
    assert options.controllers == ["lsds:belief", "lsds:pd"]
    assert "lsds:fused+lsds:fused" in options.pairs


def test_recordings_are_read_by_the_video_sensor_of_lsds(tmp_path):
    (tmp_path / "a.avi").write_bytes(b"")
    with pytest.raises(DataError, match=r"a\.avi"):
        recording_engine(tmp_path / "a.avi")


def test_collecting_uses_the_camera_of_lsds():
    config = load_config(None, PRESETS["severity"])
    assert config.pose_source.backend == "lsds:mock-truth-camera"
    with Rig(config) as rig:
        assert rig.pose_source is not None


def test_trackers_are_timed_that_are_those_of_lsds():
    pytest.importorskip("numba")
    from lsds_research.studies.frame.cost import TRACKERS, _candidates

    assert set(TRACKERS) < set(_candidates(load_config(None), PluginHost()))


def test_a_learner_that_a_study_chooses_is_that_of_lsds():
    pytest.importorskip("sklearn")
    assert Model("logistic", own=True).build(PluginHost()).job == "detect"
    with pytest.raises(PluginConflict):
        Model("logistic").build(PluginHost())
    assert all(job.model(quick=True).own for job in reproduced(quick=True) if job.learner)
