"""The pytest plugin: its fixtures, and the summary of skipped checks."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytest_plugins = "pytester"
TESTS = Path(__file__).parents[1]


@pytest.fixture
def run(pytester, monkeypatch):
    """Run a test file in this process, with the plugin and nothing else that is installed."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.syspath_prepend(str(TESTS))

    def run(text):
        pytester.makepyfile(text)
        return pytester.runpytest_inprocess("-p", "lsds.testing.pytest_plugin", "-rs")

    return run


def test_the_plugin_is_declared():
    import tomllib

    project = tomllib.loads((TESTS.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["entry-points"]["pytest11"] == {"lsds": "lsds.testing.pytest_plugin"}


def test_it_imports_nothing_heavy():
    code = "import pytest, sys; before = set(sys.modules); import lsds.testing.pytest_plugin, json; "
    code += "print(json.dumps(sorted(set(sys.modules) - before)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    new = json.loads(done.stdout)
    light = ["lsds", "lsds.support", "lsds.support.former_names", "lsds.testing", "lsds.testing.pytest_plugin"]
    assert [name for name in new if name.startswith("lsds")] == light
    assert not {"numpy", "cv2", "pydantic", "hypothesis", "pluggy"} & {name.partition(".")[0] for name in new}


def test_rigs_are_built_from_overrides_and_closed(run):
    run(
        """
        import pytest
        from lsds.errors import ConfigError

        rigs = []

        @pytest.mark.parametrize("number", [1, 2])
        def test_rig(lsds_rig, virtual_clock, number):
            assert all(rig._closed for rig in rigs)
            rig = lsds_rig("task.lift_s=1", seed=number, clock=virtual_clock)
            rigs.append(rig)
            assert (rig.config.task.lift_s, rig.config.seed) == (1, number)
            assert rig.clock is virtual_clock
            assert virtual_clock.now() == 0
            rig.connect()
            virtual_clock.sleep_until(10**9)
            assert rig.gripper.read().aperture_m > 0

        def test_wrong_key(lsds_rig):
            with pytest.raises(ConfigError):
                lsds_rig("task.lift=1")
        """
    ).assert_outcomes(passed=3)


def test_the_cell_of_a_rig(run):
    run(
        """
        def test_cell(lsds_cell):
            lsds_cell.advance(10**8)
            assert lsds_cell.truth().supported
        """
    ).assert_outcomes(passed=1)


def test_without_mocks_the_cell_is_skipped(run, monkeypatch):
    monkeypatch.setenv("LSDS_BLOCK_PLUGINS", "lsds-mocks")
    result = run("def test_cell(lsds_cell): pass")
    result.assert_outcomes(skipped=1)
    result.stdout.fnmatch_lines("*no simulated cell is installed; pip install 'lsds-tactile*sim*'*")


def test_faults_are_added_to_rigs(run):
    run(
        """
        import pytest

        def test_fault(lsds_faults, lsds_rig):
            lsds_faults("camera-noise", severity=3, at="lift")
            lsds_faults("camera-dark")
            first, second = lsds_rig().faults
            assert first[0].backend == "camera-noise"
            assert (first[0].severity, first[0].at) == (3, "lift")
            assert second[0].backend == "camera-dark"

        def test_none(lsds_rig):
            assert lsds_rig().faults == ()

        def test_too_late(lsds_faults, lsds_rig):
            lsds_rig()
            with pytest.raises(pytest.fail.Exception, match="comes after"):
                lsds_faults("camera-noise")
        """
    ).assert_outcomes(passed=3)


def test_wire_mocks_are_started_and_ended(run):
    run(
        """
        import os, pytest
        from lsds.errors import ConnectFailed

        links = []

        def test_starts(wire_mock, tmp_path):
            addresses = wire_mock("hand-e", pty=tmp_path / "hand.tty")
            links.append(tmp_path / "hand.tty")
            assert str(links[0]) in addresses.values()
            assert os.path.lexists(links[0])

        def test_has_ended():
            assert not os.path.lexists(links[0])

        def test_unknown(wire_mock):
            with pytest.raises(ConnectFailed, match="hand-f: did not start: .*lsds mock"):
                wire_mock("hand-f")
        """
    ).assert_outcomes(passed=3)


def test_isolated_plugins_have_only_the_given_manifests(run):
    run(
        """
        import pytest
        from fake_cell import plugin, SPECS

        def test_isolated(isolated_plugins):
            host = isolated_plugins(plugin(*SPECS), "lsds_drivers.manifest")
            assert "fake-gripper" in host.names("gripper")
            assert "hand-e" in host.names("gripper")
            assert "mock-hand-e" not in host.names("gripper")
            assert isolated_plugins().backends == ()

        def test_broken(isolated_plugins):
            with pytest.raises(pytest.fail.Exception, match="a manifest is not valid"):
                isolated_plugins(plugin("no spec"))
        """
    ).assert_outcomes(passed=2)


def test_the_summary_lists_what_skipped_checks_need(run):
    result = run(
        """
        from fake_cell import fake_host
        from lsds.testing import conformance

        @conformance("gripper", "real-gripper", host=fake_host())
        def test_conformance(check):
            if check.name in ("gripper_stops", "refuses_what_is_expired", "unplugged_device_is_reported"):
                check()
        """
    )
    result.stdout.fnmatch_lines(
        [
            "2 motion checks skipped: pass allow_motion=True and stay at the emergency stop",
            "1 unplug check skipped: pass unplug=FUNCTION and let it cut the device's connection",
        ]
    )


def test_there_is_no_summary_without_skipped_checks(run):
    assert "lsds checks" not in run("def test_nothing(): pass").stdout.str()
